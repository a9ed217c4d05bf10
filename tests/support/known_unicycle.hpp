// SPDX-License-Identifier: Apache-2.0
/// \file
/// The kinematic model of an ExactUnicycle, as declared, for tests of sums of its pose.
#pragma once

#include <algorithm>
#include <cmath>
#include <ostream>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "detector/multiscale/pose_sums.hpp"
#include "tests/support/exact_unicycle.hpp"

namespace wheelwright::testing_support {

/// A robot by name, for tests over many.
struct NamedUnicycle {
  std::string name;
  ExactUnicycle robot;
};
inline void PrintTo(const NamedUnicycle& n, std::ostream* out) { *out << n.name; }

/// How its log is read.
inline filter::OdometryMeasurement reading_of(const ExactUnicycle& a) {
  filter::OdometryMeasurement m;
  m.motion = MotionKind::angle;
  m.motion_columns = {"phi_r", "phi_l"};
  m.position = m.heading = true;
  m.held_pose = a.hold > 1;
  m.nominal_step = 1.0 / a.rate;
  return m;
}

/// Its parameters known to within ± `share`, its errors declared as they are; V0 from the log of another seed.
inline detector::KinematicModel known_kinematics(const ExactUnicycle& a, double share) {
  detector::KinematicModel model;
  model.measurement = reading_of(a);
  model.errors = {.motion = 0.5 * a.count,
                  .position = a.position,
                  .heading = a.heading,
                  .acceleration = a.clothoids ? kClothoidAcceleration : 0.0,
                  .yaw_gain = (1.0 + share) * std::max(a.radius_right, a.radius_left) / a.track};
  model.estimate = Eigen::Vector4d(a.radius_right, a.radius_left, a.radius_right / a.track, a.radius_left / a.track);
  for (const double value : model.estimate) {
    model.box.sides.push_back({(1.0 - share) * value, (1.0 + share) * value});
  }
  detector::PoseRiskModel& risk = model.at_risk.emplace();
  const auto errors = [&](double bound) {
    return filter::ErrorClass{bound, a.bias_share * bound, a.correlation,
                              a.deviation_share > 0.0 ? a.deviation_share * bound : core::kInfinity};
  };
  const double step = static_cast<double>(a.hold) / a.rate;
  risk.errors = {errors(a.position), errors(a.heading), (1.0 - a.jitter) * step};
  risk.box = model.box;
  for (const double scale : {0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0}) {
    if (scale >= 2.0 * step) {
      risk.scales.push_back(scale);
    }
  }
  risk.delay = std::max({0.2, 6.0 * step, 0.5 * a.correlation});
  const LogTable log = drive(a, 4242);
  TableSource source(log);
  detector::UsualPoseVariances usual = usual_pose_variances(source, model, -1e300, 1e300);
  risk.usual_position = std::move(usual.position);
  risk.usual_heading = std::move(usual.heading);
  return model;
}

/// Walks `log` through `detector`; calls at(row) after every look.
template <typename At>
void walk(const LogTable& log, detector::PoseSumDetector& detector, const At& at) {
  for (std::size_t k = 0; k < log.rows(); ++k) {
    const std::array<double, 5> sample{log.columns[0][k], log.columns[1][k], log.columns[2][k], log.columns[3][k],
                                       log.columns[4][k]};
    if (detector.step(log.t[k], sample)) {
      at(k);
    }
  }
}

/// Whether there is an alarm.
inline bool alarms(const LogTable& log, const detector::KinematicModel& model, double false_alarms) {
  detector::PoseSumDetector detector(model, {.false_alarms = false_alarms});
  bool alarm = false;
  walk(log, detector, [&](std::size_t) { alarm = alarm || detector.alarm(); });
  return alarm;
}

}  // namespace wheelwright::testing_support

// SPDX-License-Identifier: Apache-2.0
// Faults in the kinematic residual against the simulator, and margins that only it can promise.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include <gtest/gtest.h>

#include <wheelwright/commission/kinematic.hpp>
#include <wheelwright/detector/margins.hpp>
#include <wheelwright/detector/odometry_faults.hpp>

#include "support/drives.hpp"

namespace wheelwright {
namespace {

using testing_support::exact_drive;
using testing_support::filter_of;
using testing_support::noisy_drive;
using testing_support::Shown;

constexpr double kOnset = 7.0;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

FaultType find_fault(const Model& model, const std::string& name) {
  for (const FaultType& fault : fault_catalogue(model, Eigen::VectorXd::Ones(static_cast<Eigen::Index>(model.p())))) {
    if (fault.name == name) {
      return fault;
    }
  }
  throw InvalidArgument("no fault '" + name + "'");
}

OdometryMeasurement measurement_at(double rate) {
  return {.motion = MotionKind::angle,
          .motion_columns = {"phi_r", "phi_l"},
          .position = true,
          .heading = true,
          .nominal_step = 1.0 / rate};
}

Box around(const Eigen::Vector4d& parameters, double share) {
  Box box;
  for (const double x : parameters) {
    box.sides.push_back({x * (1.0 - share), x * (1.0 + share)});
  }
  return box;
}

struct Simulated {
  const char* name;
  Fault::Kind kind;
  double magnitude, kappa;
};

// What is left of the rows when the signature is taken away, over its largest size, for a drive in curves.
double error(const Simulated& each, double rate, bool drift) {
  Scenario s = exact_drive(Shown::angles, Hold::zero_order);
  s.rate = rate;
  s.duration = 10.0;
  s.sensors.pose = true;
  const Model model = make_model(s.robot);
  FaultType fault = find_fault(model, each.name);
  Fault simulated{.kind = each.kind, .magnitude = each.magnitude, .profile = {.onset = kOnset}};
  if (drift) {
    fault.profile = {.kind = FaultProfile::Kind::drift, .rise = 1.0};
    simulated.profile.shape = TimeProfile::Shape::ramp;
    simulated.profile.rise_time = 1.0;
  }
  s.faults = {simulated};
  Simulation log(s);
  const double r = s.robot.wheel_radius, c = r / s.robot.track_width;
  const Eigen::Vector4d truth(r, r, c, c);
  const OdometryMeasurement measurement = measurement_at(rate);
  const OdometryReference reference = read_odometry(log, OdometryFilter(measurement, 1.0), model);
  OdometryFaultRows rows(fault, model, measurement, reference, around(truth, 0.0));
  const auto& t = reference.motion.t;
  rows.begin(static_cast<std::size_t>(std::lower_bound(t.begin(), t.end(), kOnset - 1e-9) - t.begin()));
  double left = 0.0, size = 0.0;
  while (rows.next() && t[rows.instant()] < kOnset + 2.5) {
    for (std::size_t i = 0; i < 3; ++i) {
      const FaultRow row = rows.row(i);
      double rest = reference.motion.rows.y[static_cast<Eigen::Index>(rows.instant() * 3 + i)], added = 0.0;
      for (std::size_t j = 0; j < 4; ++j) {
        rest -= row.y[j] * truth[static_cast<Eigen::Index>(j)];
        added += each.kappa * row.g1[j] * truth[static_cast<Eigen::Index>(j)];
      }
      added += each.kappa * row.c;
      left = std::max(left, std::abs(rest - added));
      size = std::max(size, std::abs(added));
    }
  }
  EXPECT_GT(size, 0.0) << each.name;
  return left / size;
}

TEST(OdometryFaults, AreTheSimulators) {
  const double r = 0.0975;
  for (const Simulated& each : {Simulated{"wheel_radius", Fault::Kind::wheel_radius, 0.1 * r, 0.1},
                                Simulated{"wheel_radius_right", Fault::Kind::wheel_radius_right, 0.08 * r, 0.08},
                                Simulated{"wheel_radius_left", Fault::Kind::wheel_radius_left, -0.08 * r, -0.08},
                                Simulated{"matched", Fault::Kind::matched, 0.05, 0.05},
                                Simulated{"unmatched", Fault::Kind::unmatched, -0.1, -0.1},
                                Simulated{"slip_yaw", Fault::Kind::slip_yaw, 0.1, 0.1}}) {
    for (const bool drift : {false, true}) {
      const double coarse = error(each, 100.0, drift);
      EXPECT_LT(coarse, 0.01) << each.name;
      EXPECT_LT(error(each, 400.0, drift), std::max(coarse / 3.0, 1e-6)) << each.name;
    }
  }
}

// Driving straight a lateral slip cannot be promised by the torque residual, whatever its size, and is by the pose; both
// are known beforehand.
TEST(OdometryFaults, LateralSlipOnAStraightLineIsForThePose) {
  Scenario learning = noisy_drive(3, 30.0);
  learning.sensors.pose = true;
  learning.sensors.position = 0.002;
  learning.sensors.heading = 0.002;
  learning.robot.noise.position.value = 0.002;
  learning.robot.noise.heading.value = 0.002;
  Simulation log(learning);
  const Commissioning result = commission(log, learning.robot);
  ASSERT_EQ(result.status, Commissioning::Status::done) << result.message;
  ASSERT_TRUE(result.model.kinematic) << result.kinematic.message;
  const CommissionedModel& m = result.model;

  Scenario straight = learning;
  straight.sensors = exact_drive(Shown::angles, Hold::zero_order).sensors;
  straight.sensors.pose = true;
  straight.trajectory = {.kind = Trajectory::Kind::straight, .speed = 0.5};
  straight.duration = 12.0;
  Simulation drive(straight);
  const FaultType slip = find_fault(m.model, "unmatched");
  const MarginOptions options{.windows = {1.0, 2.0}, .onset_step = 2.0};

  const ReferenceMotion motion = read_reference(drive, RegressorFilter(m.model, m.filter, m.measurement, m.errors));
  for (const FaultMargins& each : margins_along(
           motion, {slip}, ThresholdRule(Polytope(m.facets, m.box), m.estimate),
           [&](const FaultType& f) { return std::make_unique<FaultFilter>(f, m.model, m.filter, motion); }, options)) {
    EXPECT_EQ(summarise(each, 0).best, kInfinity);
  }

  const KinematicModel& k = *m.kinematic;
  const OdometryReference seen = read_odometry(drive, OdometryFilter(k.measurement, k.window, k.errors), m.model);
  const auto margins = margins_along(
      seen.motion, {slip}, ThresholdRule(Polytope(k.facets, k.box), k.estimate),
      [&](const FaultType& f) { return std::make_unique<OdometryFaultRows>(f, m.model, k.measurement, seen, k.box); },
      options);
  ASSERT_EQ(margins.size(), 2u);
  for (const FaultMargins& each : margins) {
    const MarginSummary summary = summarise(each, 0, ManoeuvreKind::cruising);
    ASSERT_GT(summary.onsets, 0u);
    EXPECT_LT(summary.worst, 0.2);
    EXPECT_EQ(summary.worst, summarise(each, 0, ManoeuvreKind::cruising, 1).worst) << "the lateral output tells";
    // And so it is, in a noisy drive with a slip of that size.
    Scenario faulty = straight;
    faulty.sensors = learning.sensors;
    faulty.faults = {
        {.kind = Fault::Kind::unmatched, .magnitude = each.side * summary.worst, .profile = {.onset = 6.0}}};
    Simulation broken(faulty);
    KinematicDetector detector = make_detector(k);
    std::vector<std::size_t> pick;
    for (const auto& name : k.measurement.columns()) {
      pick.push_back(broken.find(name).value());
    }
    std::vector<double> sample(pick.size());
    double first = kInfinity;
    LogBlock block;
    while (broken.next(block)) {
      for (std::size_t row = 0; row < block.rows(); ++row) {
        for (std::size_t c = 0; c < pick.size(); ++c) {
          sample[c] = block.columns[pick[c]][row];
        }
        first = detector.step(block.t[row], sample).fault ? std::min(first, block.t[row]) : first;
      }
    }
    EXPECT_GT(first, 6.0);
    EXPECT_LE(first, 7.0 + 0.02);
  }
}

}  // namespace
}  // namespace wheelwright

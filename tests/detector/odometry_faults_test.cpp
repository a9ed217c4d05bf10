// SPDX-License-Identifier: Apache-2.0
// Faults in the kinematic residual against the simulator, and margins that only it can promise.
#include <algorithm>
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "commission/kinematic.hpp"
#include "core/limits.hpp"
#include "detector/detector.hpp"
#include "detector/faults/margins.hpp"
#include "detector/faults/odometry_faults.hpp"
#include "detector/online_model.hpp"
#include "detector/threshold.hpp"
#include "tests/detector/detectability.hpp"
#include "tests/support/drives.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::detector::odometry_faults_test {

using model::Fault;

namespace {

using testing_support::exact_drive;
using testing_support::filter_of;
using testing_support::noisy_drive;
using testing_support::Shown;

constexpr double kOnset = 7.0;

FaultType find_fault(const Model& model, const std::string& name) {
  for (const FaultType& fault : fault_catalogue(model, Eigen::VectorXd::Ones(static_cast<Eigen::Index>(model.p())))) {
    if (fault.name == name) {
      return fault;
    }
  }
  throw InvalidArgument("no fault '" + name + "'");
}

filter::OdometryMeasurement measurement_at(double rate) {
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
  const Model model = model::make_model(s.robot);
  FaultType fault = find_fault(model, each.name);
  Fault simulated{.kind = each.kind, .magnitude = each.magnitude, .profile = {.onset = kOnset}};
  if (drift) {
    fault.profile = {.kind = FaultProfile::Kind::ramp, .rise = 1.0};
    simulated.profile.shape = model::TimeProfile::Shape::ramp;
    simulated.profile.rise_time = 1.0;
  }
  s.faults = {simulated};
  Simulation log(s);
  const double r = s.robot.wheel_radius, c = r / s.robot.track_width;
  const Eigen::Vector4d truth(r, r, c, c);
  const filter::OdometryMeasurement measurement = measurement_at(rate);
  const OdometryReference reference = read_odometry(log, filter::OdometryFilter(measurement, 1.0), model);
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

// Driving straight a lateral slip cannot be promised by the torque residual, whatever its size, and is by the pose;
// both are known beforehand.
TEST(OdometryFaults, LateralSlipOnAStraightLineIsForThePose) {
  Scenario learning = noisy_drive(3, 30.0);
  learning.sensors.pose = true;
  learning.sensors.position = 0.002;
  learning.sensors.heading = 0.002;
  learning.robot.noise.position.value = 0.002;
  learning.robot.noise.heading.value = 0.002;
  Simulation log(learning);
  const Commissioning result = commission_robot(log, learning.robot);
  ASSERT_EQ(result.status, Commissioning::Status::done) << result.message;
  ASSERT_TRUE(result.model.kinematic) << result.kinematic.message;
  const OnlineModel& m = result.model;

  Scenario straight = learning;
  straight.sensors = exact_drive(Shown::angles, Hold::zero_order).sensors;
  straight.sensors.pose = true;
  straight.trajectory = {.kind = sim::Trajectory::Kind::straight, .speed = 0.5};
  straight.duration = 12.0;
  Simulation drive(straight);
  const FaultType slip = find_fault(m.model, "unmatched");
  const MarginOptions options{.windows = {1.0, 2.0}, .onset_step = 2.0};

  const ReferenceMotion motion = read_reference(drive, RegressorFilter(m.model, m.filter, m.measurement, m.errors));
  for (const FaultMargins& each : margins_along(
           motion, {slip}, ThresholdRule(Polytope(m.facets, m.box), m.estimate),
           [&](const FaultType& f) { return std::make_unique<FaultFilter>(f, m.model, m.filter, motion); }, options)) {
    EXPECT_EQ(summarise(each, 0).best, core::kInfinity);
  }

  const KinematicModel& k = *m.kinematic;
  const OdometryReference seen =
      read_odometry(drive, filter::OdometryFilter(k.measurement, k.window, k.errors), m.model);
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
    double first = core::kInfinity;
    core::for_each_sample(broken, k.measurement.columns(), [&](const core::LogSample& sample) {
      first = detector.step(sample.t, sample.values).fault ? std::min(first, sample.t) : first;
    });
    EXPECT_GT(first, 6.0);
    EXPECT_LE(first, 7.0 + 0.02);
  }
}

// Robots of all kinds with a pose, faults that a pose can see: what their own motion promises is kept.
void keep_promises(std::uint64_t first, std::uint64_t last, int& certain) {
  const std::vector<Simulated> kinds = {{"wheel_radius", Fault::Kind::wheel_radius, 0.0, 0.0},
                                        {"wheel_radius_right", Fault::Kind::wheel_radius_right, 0.0, 0.0},
                                        {"wheel_radius_left", Fault::Kind::wheel_radius_left, 0.0, 0.0},
                                        {"matched", Fault::Kind::matched, 0.0, 0.0},
                                        {"unmatched", Fault::Kind::unmatched, 0.0, 0.0},
                                        {"slip_yaw", Fault::Kind::slip_yaw, 0.0, 0.0}};
  for (std::uint64_t seed = first; seed < last; ++seed) {
    testing_support::Random random(seed);
    Scenario learning = testing_support::random_robot(seed);
    learning.duration = 20.0;
    learning.sensors.pose = true;
    learning.robot.noise.position.value = 0.001 + 0.004 * random.unit();
    learning.robot.noise.heading.value = 0.001 + 0.004 * random.unit();
    learning.sensors.position = *learning.robot.noise.position.value;
    learning.sensors.heading = *learning.robot.noise.heading.value;
    Simulation log(learning);
    const Commissioning result = commission_robot(log, learning.robot);
    ASSERT_TRUE(result.model.kinematic) << "seed " << seed << ": " << result.kinematic.message;
    const OnlineModel& m = result.model;
    const KinematicModel& k = *m.kinematic;
    for (const Simulated& kind : kinds) {
      const FaultType fault = find_fault(m.model, kind.name);
      const double side = random.unit() < 0.5 ? 1.0 : -1.0,
                   onset = 5.0 + std::floor(2.0 * learning.rate * random.unit()) / learning.rate + 0.01 / learning.rate;
      Scenario drive = learning;
      drive.seed = 7000 + seed;
      drive.duration = 9.0;
      drive.trajectory = {
          .kind = random.unit() < 0.5 ? sim::Trajectory::Kind::multi_sine : sim::Trajectory::Kind::figure_eight,
          .speed = 0.5,
          .yaw_rate = 0.8,
          .period = 6.0};
      const bool radius = kind.kind <= Fault::Kind::wheel_radius_left;
      const auto with = [&](double size, bool noisy) {
        Scenario s = drive;
        s.faults = {{.kind = kind.kind,
                     .magnitude = side * size * (radius ? s.robot.wheel_radius : 1.0),
                     .profile = {.onset = onset}}};
        if (!noisy) {
          s.sensors.position = s.sensors.heading = s.sensors.effort = 0.0;
          s.sensors.encoder_counts_per_turn.reset();
        }
        return s;
      };
      const auto promised = [&](double size) {
        Simulation own(with(size, false));
        OdometryReference reference =
            read_odometry(own, filter::OdometryFilter(k.measurement, k.window, k.errors), m.model);
        const auto& t = reference.motion.t;
        const auto at = static_cast<std::size_t>(std::lower_bound(t.begin(), t.end(), onset) - t.begin());
        for (std::size_t i = 0; i < t.size(); ++i) {
          reference.motion.settled[i] = i == at;
        }
        const auto margins =
            margins_along(reference.motion, {fault}, ThresholdRule(Polytope(k.facets, k.box), k.estimate),
                          [&](const FaultType& f) {
                            return std::make_unique<OdometryFaultRows>(f, m.model, k.measurement, reference, k.box);
                          },
                          {.windows = {1.5}});
        return margins[side > 0.0 ? 0 : 1].onsets.at(0).certain.at(0);
      };
      double size = promised(0.0);
      bool found = false;
      for (int turn = 0; turn < 12 && size < 0.5; ++turn) {
        const double needed = promised(size);
        found = needed <= size;
        if (found) {
          break;
        }
        size = 1.001 * needed;
      }
      if (!found) {
        continue;
      }
      ++certain;
      Simulation broken(with(size, true));
      KinematicDetector detector = make_detector(k);
      double alarm = core::kInfinity;
      core::for_each_sample(broken, k.measurement.columns(), [&](const core::LogSample& sample) {
        alarm = detector.step(sample.t, sample.values).fault ? std::min(alarm, sample.t) : alarm;
      });
      ASSERT_GE(alarm, onset) << kind.name << ", seed " << seed;
      ASSERT_LE(alarm, onset + 1.5 + 1.0 / drive.rate) << kind.name << " of " << side * size << ", seed " << seed;
    }
  }
}

TEST(OdometryFaults, PromisesAreKept) {
  int certain = 0;
  keep_promises(1, 3, certain);
  EXPECT_GE(certain, 8);
}

TEST(SlowOdometryFaults, PromisesAreKeptInThreeHundredRuns) {
  int certain = 0;
  keep_promises(10, 60, certain);
  EXPECT_GE(certain, 200);
}

}  // namespace
}  // namespace wheelwright::detector::odometry_faults_test

// SPDX-License-Identifier: Apache-2.0
// Sums of what odometry leaves of a pose, on a robot that rolls in closed form, under the worst laws of errors that the
// assumption allows. Risks are large here, so that a promise that is broken would show; SlowPoseSums has thousands of
// runs.
#include "detector/multiscale/pose_sums.hpp"

#include <cmath>
#include <iostream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "tests/support/known_unicycle.hpp"
#include "tests/support/most_failures.hpp"

namespace wheelwright::detector::pose_sums_test {
namespace {

using testing_support::alarms;
using testing_support::drive;
using testing_support::ExactUnicycle;
using testing_support::known_kinematics;
using testing_support::most_failures;
using testing_support::NamedUnicycle;
using testing_support::PoseLaw;
using testing_support::walk;

std::vector<NamedUnicycle> worlds() {
  std::vector<NamedUnicycle> all;
  const auto add = [&](const std::string& name, auto change) {
    ExactUnicycle robot;
    robot.seconds = 20.0;
    change(robot);
    all.push_back({name, robot});
  };
  add("two_point", [](ExactUnicycle&) {});
  add("uniform", [](ExactUnicycle& a) { a.law = PoseLaw::uniform; });
  add("uniform_declared", [](ExactUnicycle& a) {
    a.law = PoseLaw::uniform;
    a.deviation_share = 1.0 / std::sqrt(3.0);
  });
  add("spikes", [](ExactUnicycle& a) {
    a.law = PoseLaw::spikes;
    a.deviation_share = 0.2;
  });
  add("biased", [](ExactUnicycle& a) { a.bias_share = 0.1; });
  add("by_speed", [](ExactUnicycle& a) { a.law = PoseLaw::by_speed; });
  add("gambler", [](ExactUnicycle& a) { a.law = PoseLaw::gambler; });
  add("together", [](ExactUnicycle& a) {
    a.law = PoseLaw::together;
    a.correlation = 0.1;
  });
  add("alike", [](ExactUnicycle& a) { a.law = PoseLaw::alike; });
  add("ahead", [](ExactUnicycle& a) { a.law = PoseLaw::ahead; });
  add("feedback", [](ExactUnicycle& a) { a.feedback = 300.0; });
  add("clothoids", [](ExactUnicycle& a) { a.clothoids = true; });
  add("uneven_steps", [](ExactUnicycle& a) { a.jitter = 0.3; });
  add("slow", [](ExactUnicycle& a) { a.rate = 10.0; });
  add("fast", [](ExactUnicycle& a) {
    a.rate = 500.0;
    a.seconds = 6.0;
  });
  add("held_pose", [](ExactUnicycle& a) { a.hold = 10; });
  add("coarse_wheels", [](ExactUnicycle& a) { a.count = 2e-2; });
  return all;
}

// Runs with a false alarm, where 1e-2 a run are promised at most.
std::size_t runs_with_alarm(const ExactUnicycle& robot, double share, std::size_t runs) {
  const KinematicModel model = known_kinematics(robot, share);
  std::size_t count = 0;
  for (std::size_t k = 0; k < runs; ++k) {
    count += alarms(drive(robot, 1 + k), model, 1e-2 / robot.seconds) ? 1 : 0;
  }
  return count;
}

class PoseSums : public ::testing::TestWithParam<NamedUnicycle> {};

TEST_P(PoseSums, RaiseNoMoreFalseAlarmsThanTheySay) {
  constexpr std::size_t kRuns = 30;
  EXPECT_LE(runs_with_alarm(GetParam().robot, 0.0, kRuns), most_failures(kRuns, 1e-2));
}

INSTANTIATE_TEST_SUITE_P(Worlds, PoseSums, ::testing::ValuesIn(worlds()),
                         [](const auto& each) { return each.param.name; });

class SlowPoseSums : public PoseSums {};

TEST_P(SlowPoseSums, RaiseNoMoreFalseAlarmsThanTheySay) {
  constexpr std::size_t kRuns = 3000;
  const std::size_t known = runs_with_alarm(GetParam().robot, 0.0, kRuns);
  std::cout << GetParam().name << ": " << known << " of " << kRuns << " runs with a false alarm\n";
  EXPECT_LE(known, most_failures(kRuns, 1e-2));
}

INSTANTIATE_TEST_SUITE_P(Worlds, SlowPoseSums, ::testing::ValuesIn(worlds()),
                         [](const auto& each) { return each.param.name; });

ExactUnicycle exact() {
  ExactUnicycle robot;
  robot.position = robot.heading = 0.0;
  robot.count = 1e-13;
  robot.seconds = 15.0;
  return robot;
}

// The same log read by a model that knows of no errors but these.
KinematicModel model_with(const ExactUnicycle& robot, double position, double heading, bool clothoids) {
  ExactUnicycle declared = robot;
  declared.position = position;
  declared.heading = heading;
  declared.clothoids = clothoids;
  return known_kinematics(declared, 0.0);
}

TEST(PoseSums, OfAnExactPoseAreNothingBeyondRounding) {
  for (const bool clothoids : {false, true}) {
    ExactUnicycle robot = exact();
    robot.clothoids = clothoids;
    const LogTable log = drive(robot, 3);
    PoseSumDetector detector(model_with(robot, 1e-15, 1e-15, clothoids));
    std::size_t looks = 0;
    double most = 0.0, radius = 0.0;
    walk(log, detector, [&](std::size_t) {
      EXPECT_FALSE(detector.alarm());
      for (const SumState& look : detector.looks()) {
        ++looks;
        most = std::max(most, std::abs(look.value));
        radius = std::max(radius, look.radius);
        ASSERT_LE(std::abs(look.value), look.radius) << detector.weights()[look.weight].name << " " << look.scale;
      }
    });
    EXPECT_GT(looks, 1000u);
    EXPECT_LT(most, clothoids ? 1e-3 : 1e-10);
  }
}

// Of every sum its last value, and V of errors of position and heading at that look (weights × scales).
struct Last {
  Eigen::MatrixXd value, position, heading;
};

Last last_looks(const LogTable& log, const KinematicModel& model) {
  PoseSumDetector detector(model);
  const Eigen::MatrixXd none = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(detector.weights().size()),
                                                     static_cast<Eigen::Index>(detector.scales().size()));
  Last last{none, none, none};
  walk(log, detector, [&](std::size_t) {
    const Eigen::MatrixXd position = detector.position_variances(), heading = detector.heading_variances();
    for (const SumState& look : detector.looks()) {
      const auto w = static_cast<Eigen::Index>(look.weight), s = static_cast<Eigen::Index>(look.scale);
      last.value(w, s) = look.value;
      last.position(w, s) = position(w, s);
      last.heading(w, s) = heading(w, s);
    }
  });
  return last;
}

// Σ of the squares of what moving each single sample of these columns by 1 does to every sum, to first order.
Eigen::MatrixXd squared_factors(const LogTable& log, const KinematicModel& model,
                                const std::vector<std::size_t>& columns, double by) {
  const Eigen::MatrixXd before = last_looks(log, model).value;
  Eigen::MatrixXd squares = Eigen::MatrixXd::Zero(before.rows(), before.cols());
  for (const std::size_t column : columns) {
    for (std::size_t k = 0; k < log.rows(); ++k) {
      LogTable other = log;
      other.columns[column][k] += by;
      squares += ((last_looks(other, model).value - before) / by).cwiseAbs2();
    }
  }
  return squares;
}

// Every error's factor, found by moving that one sample, and Hoeffding's proxy of them all.
TEST(PoseSums, KnowTheFactorOfEveryError) {
  ExactUnicycle robot = exact();
  robot.seconds = 2.5;
  const LogTable log = drive(robot, 5);
  const KinematicModel model = model_with(robot, 1.0, 1e-9, false);
  const Eigen::MatrixXd squares = squared_factors(log, model, {2, 3}, 1e-3), V = last_looks(log, model).position;
  for (Eigen::Index w = 0; w < 4; ++w) {
    for (Eigen::Index s = 0; s < 4; ++s) {  // looked at within the log
      ASSERT_GT(squares(w, s), 0.0);
      EXPECT_NEAR(V(w, s) / (2.0 * squares(w, s)), 1.0, 1e-6) << w << " " << s;
    }
  }
}

TEST(PoseSums, KnowTheFactorOfEveryHeadingError) {
  ExactUnicycle robot = exact();
  robot.seconds = 5.0;
  const LogTable log = drive(robot, 5);
  const KinematicModel model = model_with(robot, 1e-9, 1.0, false);
  const Eigen::MatrixXd squares = squared_factors(log, model, {4}, 1e-5), V = last_looks(log, model).heading;
  const std::vector<PoseWeight> weights = pose_weights(model.measurement);
  for (std::size_t w = 0; w < weights.size(); ++w) {
    const bool turns = !weights[w].of_position(), across = weights[w].shape == PoseWeight::Shape::across;
    for (Eigen::Index s = 0; s < 3 && (turns || across); ++s) {  // the way across is foreseen, not known
      const double square = squares(static_cast<Eigen::Index>(w), s);
      ASSERT_GT(square, 0.0);
      EXPECT_NEAR(V(static_cast<Eigen::Index>(w), s) / square, 1.0, turns ? 1e-4 : 0.2) << weights[w].name << " " << s;
    }
  }
}

// What is left out of the assumption is seen: the test above can fail.
TEST(PoseSums, SeeErrorsThatAreNotAsDeclared) {
  ExactUnicycle declared;
  declared.seconds = 60.0;
  ExactUnicycle biased = declared;
  biased.law = PoseLaw::together;
  biased.correlation = 5.0;
  EXPECT_TRUE(alarms(drive(biased, 1), known_kinematics(declared, 0.0), 1e-2 / 60.0));
}

TEST(PoseSums, SeeFaults) {
  ExactUnicycle healthy;
  healthy.seconds = 60.0;
  const KinematicModel model = known_kinematics(healthy, 0.002);
  const double year = 1.0 / (365.25 * 86400.0);
  const auto seen = [&](auto change) {
    ExactUnicycle broken = healthy;
    broken.fault_at = 20.0;
    change(broken);
    return alarms(drive(broken, 7), model, year);
  };
  EXPECT_FALSE(seen([](ExactUnicycle&) {}));
  EXPECT_TRUE(seen([](ExactUnicycle& a) { a.slip_along = 0.01; }));
  EXPECT_TRUE(seen([](ExactUnicycle& a) { a.slip_across = 0.01; }));
  EXPECT_TRUE(seen([](ExactUnicycle& a) { a.radius_right_by = 0.02; }));
  EXPECT_TRUE(seen([](ExactUnicycle& a) { a.track_by = 0.03; }));
  EXPECT_TRUE(seen([](ExactUnicycle& a) { a.encoder_right_by = 0.02; }));
}

TEST(PoseSums, BeginAnewAfterAGap) {
  ExactUnicycle robot;
  const KinematicModel model = known_kinematics(robot, 0.0);
  const LogTable log = drive(robot, 2);
  PoseSumDetector once(model), twice(model);
  walk(log, once, [](std::size_t) {});
  LogTable later = log;
  for (double& t : later.t) {
    t += 1000.0;
  }
  walk(log, twice, [](std::size_t) {});
  walk(later, twice, [](std::size_t) {});
  EXPECT_LT((once.position_variances() - twice.position_variances()).cwiseAbs().maxCoeff(),
            1e-9 * once.position_variances().maxCoeff());
}

TEST(PoseSums, WantAModelAtAStatedRisk) {
  KinematicModel model = known_kinematics({}, 0.01);
  EXPECT_THROW(PoseSumDetector(model, {.false_alarms = 0.0}), InvalidArgument);
  KinematicModel blind = model;
  blind.at_risk->usual_position.resize(1, 1);
  EXPECT_THROW(PoseSumDetector{blind}, InvalidArgument);
  model.at_risk.reset();
  EXPECT_THROW(PoseSumDetector{model}, InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::detector::pose_sums_test

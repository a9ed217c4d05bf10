// SPDX-License-Identifier: Apache-2.0
// Every point of the cube is a manoeuvre within the limits that retraces its path.
#include "commission/design/stages.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "commission/design/subject.hpp"
#include "core/error.hpp"
#include "tests/design/robots.hpp"

namespace wheelwright::design::stages_test {
namespace {

using testing_support::large_robot;
using testing_support::small_robot;

constexpr double kStep = 0.01;

std::vector<double> somewhere(std::size_t dimension, std::mt19937_64& generator) {
  std::vector<double> x(dimension);
  for (double& value : x) {
    value = static_cast<double>(generator() >> 11) * 0x1p-53;
  }
  return x;
}

// Wheel torques of (15) from the nominal values, written out.
Eigen::Vector2d torque(const Robot& robot, const Eigen::Vector2d& v, const Eigen::Vector2d& a) {
  const double force = robot.nominal.at("mass") * a[0] + robot.nominal.at("viscous_linear") * v[0];
  const double moment = robot.nominal.at("yaw_inertia") * a[1] + robot.nominal.at("viscous_yaw") * v[1];
  const double half_sum = 0.5 * robot.wheel_radius * force;
  const double half_difference = robot.wheel_radius * moment / robot.track_width;
  return {half_sum + half_difference, half_sum - half_difference};
}

TEST(Stages, EveryPointOfTheCubeKeepsToTheLimits) {
  std::mt19937_64 generator(11);
  for (const Robot& robot : {small_robot(), large_robot()}) {
    const DesignSubject subject = subject_of(robot, kStep);
    MotionLimits limits = limits_of(robot);
    limits.duration = 12.0;
    for (int trial = 0; trial < 30; ++trial) {
      limits.effort = (0.2 + 0.4 * (trial % 3)) * robot.limits.at("effort");
      limits.radius = trial % 2 == 0 ? std::optional(0.5) : std::nullopt;
      limits.box.reset();
      if (trial % 2 == 1) {
        limits.box = {Interval{-0.2, 1.0}, Interval{-0.5, 0.3}};
      }
      const StageFamily family(subject, limits, 1 + static_cast<std::size_t>(trial % 5));
      const Plan plan = family.plan(somewhere(family.dimension(), generator), kStep);
      const LogTable table = command_table(plan, subject.model);
      ASSERT_EQ(table.rows(), 1201U);
      for (std::size_t k = 0; k < table.rows(); ++k) {
        const Eigen::Vector2d wheel(table.column("command_r")[k], table.column("command_l")[k]);
        const auto at = static_cast<Eigen::Index>(k);
        ASSERT_LE(wheel.cwiseAbs().maxCoeff(), limits.joint_speed);
        ASSERT_LE(torque(robot, plan.speed.col(at), plan.acceleration.col(at)).cwiseAbs().maxCoeff(),
                  *limits.effort * (1.0 + 1e-12));
        const double x = table.column("x")[k], y = table.column("y")[k];
        if (limits.radius) {
          ASSERT_LE(std::hypot(x, y), 0.5);
        } else {
          ASSERT_TRUE(x >= -0.2 && x <= 1.0 && y >= -0.5 && y <= 0.3);
        }
        if (k > 0) {
          const Eigen::Vector2d before(table.column("command_r")[k - 1], table.column("command_l")[k - 1]);
          ASSERT_LE((wheel - before).cwiseAbs().maxCoeff() / kStep, *limits.joint_acceleration * (1.0 + 1e-9));
        }
      }
      EXPECT_EQ(plan.speed.col(0), Eigen::Vector2d::Zero());
      EXPECT_EQ(plan.speed.col(plan.samples() - 1), Eigen::Vector2d::Zero());
    }
  }
}

TEST(Stages, TheSecondHalfIsTheFirstOneBackwards) {
  std::mt19937_64 generator(12);
  const DesignSubject subject = subject_of(small_robot(), kStep);
  MotionLimits limits = limits_of(small_robot());
  limits.radius = 1.0;
  for (int trial = 0; trial < 10; ++trial) {
    const StageFamily family(subject, limits, 3);
    const Plan plan = family.plan(somewhere(family.dimension(), generator), kStep);
    const Eigen::Index last = plan.samples() - 1;
    for (Eigen::Index k = 0; 2 * k < last; ++k) {
      ASSERT_LT((plan.speed.col(k) + plan.speed.col(last - k)).norm(), 1e-9) << k;
      ASSERT_LT((plan.acceleration.col(k) - plan.acceleration.col(last - k)).norm(), 1e-6) << k;
      ASSERT_LT((plan.pose.col(k) - plan.pose.col(last - k)).norm(), 1e-9) << k;
    }
  }
}

TEST(Stages, AccelerationIsTheDerivativeOfSpeed) {
  std::mt19937_64 generator(13);
  const DesignSubject subject = subject_of(large_robot(), kStep);
  const StageFamily family(subject, limits_of(large_robot()), 3);
  constexpr double h = 1e-4;
  const Plan plan = family.plan(somewhere(family.dimension(), generator), h);
  double jerk = 0.0;
  for (Eigen::Index k = 1; k < plan.samples(); ++k) {
    jerk = std::max(jerk, (plan.acceleration.col(k) - plan.acceleration.col(k - 1)).norm() / h);
  }
  for (Eigen::Index k = 1; k + 1 < plan.samples(); ++k) {
    const Eigen::Vector2d slope = (plan.speed.col(k + 1) - plan.speed.col(k - 1)) / (2.0 * h);
    ASSERT_LE((slope - plan.acceleration.col(k)).norm(), jerk * h) << k;
  }
}

TEST(Stages, ASingleAxisStaysWithinItsTravel) {
  Robot axis;
  axis.model = "single_axis";
  axis.nominal = {{"inertia", 100.0}, {"viscous", 200.0}, {"coulomb", 20.0}, {"offset", 0.0}};
  axis.parameters = std::vector<std::string>{"inertia", "viscous", "coulomb", "offset"};
  axis.noise.position.value = 1e-5;
  axis.noise.effort.value = 1.0;
  const DesignSubject subject = subject_of(axis, kStep);
  const MotionLimits limits{
      .duration = 8.0, .joint_speed = 0.5, .joint_acceleration = 2.0, .effort = 150.0, .radius = 0.2, .box = {}};
  const StageFamily family(subject, limits, 2);
  std::mt19937_64 generator(14);
  for (int trial = 0; trial < 10; ++trial) {
    const LogTable table = command_table(family.plan(somewhere(family.dimension(), generator), kStep), subject.model);
    for (const double position : table.column("position")) {
      ASSERT_LE(std::abs(position), 0.2);
    }
    ASSERT_NEAR(table.column("position").back(), 0.0, 1e-9);
  }
}

TEST(Stages, ImpossibleLimitsAreMisuse) {
  const DesignSubject subject = subject_of(small_robot(), kStep);
  const MotionLimits good = limits_of(small_robot());
  const auto with = [&](auto change) {
    MotionLimits limits = good;
    change(limits);
    return StageFamily(subject, limits, 2);
  };
  EXPECT_NO_THROW(with([](MotionLimits&) {}));
  EXPECT_THROW(with([](MotionLimits& l) { l.duration = 0.1; }), InvalidArgument);
  EXPECT_THROW(with([](MotionLimits& l) { l.joint_speed = 0.0; }), InvalidArgument);
  EXPECT_THROW(with([](MotionLimits& l) { l.effort = -1.0; }), InvalidArgument);
  EXPECT_THROW(with([](MotionLimits& l) { l.radius = std::nan(""); }), InvalidArgument);
  EXPECT_THROW(with([](MotionLimits& l) { l.box = {Interval{0.1, 1.0}, Interval{-1.0, 1.0}}; }), InvalidArgument);
  EXPECT_THROW(with([](MotionLimits& l) {
                 l.effort.reset();
                 l.joint_acceleration.reset();
               }),
               InvalidArgument);
  EXPECT_THROW(StageFamily(subject, good, 0), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::design::stages_test

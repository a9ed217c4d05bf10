// SPDX-License-Identifier: Apache-2.0
// A designed manoeuvre against a figure eight: both are driven in simulation, with noise and with parameters that are
// not the believed ones, and both logs are commissioned.
#include "commission/commission.hpp"
#include "commission/design/manoeuvre.hpp"

#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

#include "commission/design/subject.hpp"
#include "model/sim/simulation.hpp"
#include "tests/design/robots.hpp"

namespace wheelwright::design::slow_manoeuvre_test {
namespace {

using testing_support::large_robot;
using testing_support::small_robot;

const DesignOptions kQuick{.samples = 100, .descents = 2, .steps = 150};

// The robot drives `plan`; the truth is up to a fifth off what is believed.
Scenario driven(const Robot& robot, const Plan& plan, std::uint64_t seed) {
  Scenario s = testing_support::drive_of(plan, robot, seed);
  s.parameters = {.mass = 1.1 * robot.nominal.at("mass"),
                  .yaw_inertia = 0.9 * robot.nominal.at("yaw_inertia"),
                  .viscous_x = 1.2 * robot.nominal.at("viscous_linear"),
                  .viscous_y = 1.2 * robot.nominal.at("viscous_linear"),
                  .viscous_yaw = 1.2 * robot.nominal.at("viscous_yaw")};
  s.torque_limit = robot.limits.at("effort");
  return s;
}

// Widths of the commissioned bounds, which hold the truth.
Eigen::VectorXd widths(const Scenario& scenario) {
  Simulation log(scenario);
  const Commissioning result = commission_robot(log, scenario.robot);
  EXPECT_EQ(result.status, Commissioning::Status::done);
  const Eigen::VectorXd truth = sim::true_parameters(scenario, result.model.model);
  Eigen::VectorXd w(truth.size());
  for (Eigen::Index j = 0; j < w.size(); ++j) {
    const commission::ParameterResult& p = result.parameters[static_cast<std::size_t>(j)];
    EXPECT_LE(p.lower, truth[j]);
    EXPECT_GE(p.upper, truth[j]);
    w[j] = p.upper - p.lower;
  }
  return w;
}

// Half in the geometric mean, which is what was asked for, and three quarters for the worst parameter.
TEST(SlowManoeuvre, WidthsAreHalfThoseOfTheBestFigureEightInTheMeanAndThreeQuartersAtMost) {
  for (const Robot& robot : {small_robot(), large_robot()}) {
    for (const double radius : {0.6, 2.0}) {
      const DesignSubject subject = subject_of(robot, 0.01);
      MotionLimits limits = limits_of(robot);
      limits.duration = 20.0;
      limits.radius = radius;
      const BoundsDesign design = design_for_bounds(subject, limits, WidthCriterion::geometric_mean, kQuick);
      EXPECT_LE(design.manoeuvre.use.largest(), 1.0);
      ASSERT_TRUE(design.figure_eight_plan);
      EXPECT_LE(limit_use(*design.figure_eight_plan, subject, limits).largest(), 1.0 + 1e-3);
      for (const std::uint64_t seed : {1U, 2U}) {
        const Eigen::VectorXd mine = widths(driven(robot, design.manoeuvre.plan, seed));
        const Eigen::VectorXd eight = widths(driven(robot, *design.figure_eight_plan, seed));
        const Eigen::ArrayXd ratio = mine.array() / eight.array();
        EXPECT_LE(std::exp(ratio.log().mean()), 0.5) << robot.name << " " << radius << ": " << ratio.transpose();
        // No parameter is sold for the others. (Speeds of both kinds share one limit of wheel speed, so that the best
        // eight is already within a factor of two of it in some direction.)
        EXPECT_LE(ratio.maxCoeff(), 0.75) << robot.name << " " << radius << ": " << ratio.transpose();
        for (Eigen::Index j = 0; j < mine.size(); ++j) {
          const Interval& promised = design.promised.sides[static_cast<std::size_t>(j)];
          // The promise is of first order in what the truth differs from what is believed: a fifth at most here.
          EXPECT_LE(mine[j], 1.2 * (promised.upper - promised.lower)) << robot.name << " " << j;
        }
      }
    }
  }
}

TEST(SlowManoeuvre, IsTheSameForASeedWhateverTheThreads) {
  const DesignSubject subject = subject_of(small_robot(), 0.02);
  MotionLimits limits = limits_of(small_robot());
  limits.duration = 8.0;
  const RowObjective objective = narrow_bounds(subject, WidthCriterion::mean);
  DesignOptions options{.stages = 2, .samples = 20, .descents = 2, .steps = 30};
  const Manoeuvre a = design_manoeuvre(subject, limits, objective, options);
  options.threads = 2;
  const Manoeuvre b = design_manoeuvre(subject, limits, objective, options);
  EXPECT_EQ(a.plan.speed, b.plan.speed);
  EXPECT_EQ(a.objective, b.objective);
}

TEST(SlowManoeuvre, AnyFunctionOfTheRowsCanBeTheAim) {
  const DesignSubject subject = subject_of(small_robot(), 0.02);
  MotionLimits limits = limits_of(small_robot());
  limits.duration = 8.0;
  limits.radius = 1.0;
  // The largest filtered yaw acceleration: turning on the spot, one wheel against the other.
  const RowObjective aim = [](const RegressionBlock& rows) { return -rows.Y.col(1).maxCoeff(); };
  const Manoeuvre found =
      design_manoeuvre(subject, limits, aim, {.stages = 2, .samples = 50, .descents = 2, .steps = 150});
  // Both wheels at their limits of acceleration give 2·20·r/D = 10.2 rad/s²; the filter sees most of it.
  EXPECT_GT(-found.objective, 0.7 * 2.0 * 20.0 * 0.0975 / 0.381);
}

}  // namespace
}  // namespace wheelwright::design::slow_manoeuvre_test

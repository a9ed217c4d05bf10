// SPDX-License-Identifier: Apache-2.0
// Rollouts against closed forms, and against the simulator that made the log.
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "gap/rollout.hpp"
#include "tests/gap/simulated_gap.hpp"

namespace wheelwright::gap::rollout_test {
namespace {

using gap_example::drive_of_log;
using gap_example::plain_robot;
using gap_example::simulated_drive;

double largest(const std::vector<RolloutErrors>& errors) {
  double most = 0.0;
  for (const RolloutErrors& e : errors) {
    for (const Eigen::VectorXd* values : {&e.velocity, &e.yaw_rate, &e.position, &e.heading}) {
      most = std::max(most, values->cwiseAbs().maxCoeff());
    }
  }
  return most;
}

// Largest error of a robot on its own noise-free log at `rate`, smoothed over five samples.
double own_error(const Robot& world, double rate) {
  const Drive drive =
      drive_of_log(sim::simulate(simulated_drive(world, 12.0, rate)), plain_robot(), {.smoothing_window = 4.0 / rate});
  const std::vector<Eigen::Index> starts = rollout_starts(drive, {}, rollout_margin(world));
  EXPECT_GE(starts.size(), 15u);
  return largest(rollouts(drive, world, starts));
}

// What is left on the simulator's own log is the error of smoothing: of second order in the step or better.
TEST(Rollout, OfTheLogsOwnRobotVanishesWithTheStep) {
  const double coarse = own_error(plain_robot(), 50.0), fine = own_error(plain_robot(), 200.0);
  EXPECT_LT(coarse, 0.02);
  EXPECT_LT(fine, coarse / 12.0);
}

TEST(Rollout, EffectsActAsInTheSimulation) {
  const std::vector<model::RobotEffect> effects = {{"slope", {{"g_x", {0.2, 0.2}}, {"g_y", {-0.1, -0.1}}}},
                                                   {"com_longitudinal", {{"a", {0.05, 0.05}}}},
                                                   {"torque_gain_asymmetric", {{"g", {0.1, 0.1}}}},
                                                   {"delay", {{"T_d", {0.05, 0.05}}}},
                                                   {"actuator_lag", {{"T", {0.05, 0.05}}}},
                                                   {"sensor_time_offset", {{"dt", {0.04, 0.04}}}},
                                                   {"battery_sag", {{"k", {0.01, 0.01}}, {"R_b", {0.02, 0.02}}}},
                                                   {"friction_drift", {{"k", {0.5, 0.5}}, {"T", {8.0, 8.0}}}},
                                                   {"longitudinal_slip", {{"stiffness", {1000.0, 1000.0}}}},
                                                   {"encoder_scale", {{"s_R", {0.02, 0.02}}, {"s_L", {-0.01, -0.01}}}}};
  for (const model::RobotEffect& effect : effects) {
    Robot world = plain_robot();
    world.effects = {effect};
    const Drive drive = drive_of_log(sim::simulate(simulated_drive(world, 9.0, 200.0)), plain_robot());
    const std::vector<Eigen::Index> starts = rollout_starts(drive, {.fewest = 4}, rollout_margin(world));
    const double own = largest(rollouts(drive, world, starts));
    EXPECT_LT(own, 3e-3) << effect.name;
    EXPECT_GT(largest(rollouts(drive, plain_robot(), starts)), 10.0 * own) << effect.name;
  }
}

// A wrong mass under constant torque: v̇ = τ/(r m) without friction, so v errs by (1/m' − 1/m) τ t/r and the way by
// half of that times t.
TEST(Rollout, OfAWrongMassHasTheClosedForm) {
  Robot robot = plain_robot();
  robot.nominal = {{"mass", 20.0}, {"yaw_inertia", 1.0}, {"viscous_linear", 0.0}, {"viscous_yaw", 0.0}};
  robot.speed_source = model::SpeedSource::measured;
  LogTable log;
  log.names = {"omega_r", "omega_l", "tau_r", "tau_l", "x", "y", "theta"};
  log.columns.resize(7);
  const double acceleration = 0.1, torque = 0.5 * 20.0 * acceleration * robot.wheel_radius;
  for (int k = 0; k <= 1200; ++k) {
    const double t = 0.01 * k;
    log.t.push_back(t);
    const double values[] = {acceleration * t / robot.wheel_radius,
                             acceleration * t / robot.wheel_radius,
                             torque,
                             torque,
                             0.5 * acceleration * t * t,
                             0.0,
                             0.0};
    for (std::size_t c = 0; c < 7; ++c) {
      log.columns[c].push_back(values[c]);
    }
  }
  const Drive drive = drive_of_log(log, robot);
  Robot heavy = robot;
  heavy.nominal["mass"] = 25.0;
  const std::vector<RolloutErrors> errors = rollouts(drive, heavy, rollout_starts(drive, {}));
  ASSERT_EQ(errors.size(), 2u);
  for (const RolloutErrors& e : errors) {
    const double off = (20.0 / 25.0 - 1.0) * acceleration * e.horizon;
    EXPECT_LT((e.velocity.array() - off).abs().maxCoeff(), 1e-9);
    EXPECT_LT((e.position.array() - 0.5 * std::abs(off) * e.horizon).abs().maxCoeff(), 1e-9);
    EXPECT_LT(e.heading.cwiseAbs().maxCoeff(), 1e-9);
  }
  Drive blind = drive;  // without a pose odometry stands for it
  blind.x.resize(0);
  blind.y.resize(0);
  blind.heading.resize(0);
  const std::vector<RolloutErrors> odometry = rollouts(blind, heavy, rollout_starts(blind, {}));
  EXPECT_LT((odometry[1].position - errors[1].position).cwiseAbs().maxCoeff(), 1e-6);
}

// Noise of one initial speed alone: v decays with f/m on the way, and the log's end has the noise too.
TEST(Rollout, NoiseOfTheStartGoesOnToTheEnd) {
  const Drive drive = drive_of_log(sim::simulate(simulated_drive(plain_robot(), 12.0)), plain_robot());
  const std::vector<Eigen::Index> starts = rollout_starts(drive, {});
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(drive.rows());
  const Eigen::VectorXd offset = Eigen::VectorXd::Constant(drive.rows(), 0.1);
  const auto errors = rollout_noise(drive, plain_robot(), starts, {offset, offset}, {none, none});
  const double v = 0.1 * 0.0975;
  EXPECT_NEAR(errors[0].velocity[0], v * (std::exp(-4.0 / 21.0) - 1.0), 1e-9);
  EXPECT_EQ(largest(rollout_noise(drive, plain_robot(), starts, {none, none}, {none, none})), 0.0);
}

TEST(Rollout, WindowsLieWithinSegmentsAndAreManyWhereTheLogAllows) {
  Scenario s = simulated_drive(plain_robot(), 30.0);
  s.gaps = {{10.0, 11.0}};
  const Drive drive = drive_of_log(sim::simulate(s), plain_robot());
  const std::vector<Eigen::Index> starts = rollout_starts(drive, {}, 0.5);
  EXPECT_GE(starts.size(), 20u);
  for (const Eigen::Index k : starts) {
    const double begin = drive.t[k] - 0.5, end = drive.t[k] + 5.5;
    EXPECT_TRUE(begin >= 0.0 && end <= 30.0 && (end < 10.0 || begin >= 11.0)) << drive.t[k];
  }
  const Drive longer = drive_of_log(sim::simulate(simulated_drive(plain_robot(), 130.0, 50.0)), plain_robot());
  const std::size_t count = rollout_starts(longer, {}).size();
  EXPECT_GE(count, 30u);
  EXPECT_LE(count, 45u);
}

TEST(Rollout, ResultsDoNotDependOnThreads) {
  const Drive drive = drive_of_log(sim::simulate(simulated_drive(plain_robot(), 12.0)), plain_robot());
  const std::vector<Eigen::Index> starts = rollout_starts(drive, {});
  EXPECT_EQ(rollouts(drive, plain_robot(), starts, {.threads = 2})[1].position,
            rollouts(drive, plain_robot(), starts)[1].position);
}

TEST(Rollout, NeedsNominalValues) {
  const Drive drive = drive_of_log(sim::simulate(simulated_drive(plain_robot(), 8.0)), plain_robot());
  Robot unknown = plain_robot();
  unknown.nominal.erase("mass");
  EXPECT_THROW(static_cast<void>(rollouts(drive, unknown, {10})), InvalidArgument);
}

// For independent values the interval of the root mean square is about ±1.96·√(kurtosis − 1)/(2√n) of it.
TEST(RolloutRms, IntervalIsThatOfIndependentValues) {
  Eigen::VectorXd values(400);
  std::mt19937_64 generator(5);
  for (double& x : values) {
    x = static_cast<double>(generator() >> 11) / 9007199254740992.0 * 2.0 - 1.0;
  }
  const RolloutRms rms = rollout_rms(values, 3, 1);
  EXPECT_NEAR(rms.rms, 1.0 / std::sqrt(3.0), 0.03);
  const double half = 1.96 * std::sqrt(1.8 - 1.0) / (2.0 * std::sqrt(400.0)) * rms.rms;
  EXPECT_NEAR(rms.upper - rms.lower, 2.0 * half, 0.3 * half);
  const RolloutRms same = rollout_rms(Eigen::VectorXd::Constant(20, -2.0), 3);
  EXPECT_DOUBLE_EQ(same.rms, 2.0);
  EXPECT_DOUBLE_EQ(same.lower, 2.0);
  EXPECT_DOUBLE_EQ(same.upper, 2.0);
}

}  // namespace
}  // namespace wheelwright::gap::rollout_test

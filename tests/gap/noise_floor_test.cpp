// SPDX-License-Identifier: Apache-2.0
// Oracle: what noise does to the rows of the very same motion, simulated with and without it.
#include "gap/noise_floor.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "tests/gap/simulated_gap.hpp"

namespace wheelwright::gap::noise_floor_test {
namespace {

using gap_example::drive_of_log;
using gap_example::kYawFriction;
using gap_example::plain_robot;
using gap_example::simulated_drive;

constexpr double kBeta = 10.0;

Scenario long_drive(Hold hold = Hold::first_order) {
  Robot robot = plain_robot();
  robot.hold = hold;
  Scenario s = simulated_drive(robot, 600.0, 50.0);
  s.sensors.noise = sim::NoiseShape::truncated_gaussian;
  return s;
}

// Rows of f₂ * (y − Yθ) over all settled instants.
Eigen::MatrixXd rows_of_log(const Drive& drive) {
  NoiseFloor any;
  any.efforts = Eigen::Vector2d(1.0, 1.0);
  GapRowOptions options;
  options.beta = kBeta;
  options.skip_rest = false;
  const GapRows rows = make_gap_rows(drive, any, {}, options);
  Eigen::MatrixXd both(rows.spaces[0].response.size(), 2);
  both << rows.spaces[0].response, rows.spaces[1].response;
  return both;
}

Eigen::Vector2d sample_deviation(const Drive& noisy, const Drive& clean) {
  const Eigen::MatrixXd noise = rows_of_log(noisy) - rows_of_log(clean);
  return (noise.colwise().squaredNorm() / static_cast<double>(noise.rows())).cwiseSqrt().transpose();
}

// `bias` of the estimate itself.
void expect_floor(const Scenario& scenario, const char* what, double bias = 1.0) {
  SCOPED_TRACE(what);
  Scenario silent = scenario;
  silent.sensors.effort = silent.sensors.wheel_speed = 0.0;
  silent.sensors.encoder_counts_per_turn.reset();
  Robot robot = scenario.robot;
  robot.encoder_counts_per_turn = scenario.sensors.encoder_counts_per_turn;
  const Drive noisy = drive_of_log(sim::simulate(scenario), robot);
  const Drive clean = drive_of_log(sim::simulate(silent), silent.robot);
  const Eigen::Vector2d measured = sample_deviation(noisy, clean);
  const Eigen::VectorXd floor = noise_floor(noisy, signal_noise(noisy), kBeta).efforts;
  EXPECT_NEAR(floor[0], bias * measured[0], 0.05 * measured[0]);
  EXPECT_NEAR(floor[1], bias * measured[1], 0.05 * measured[1]);
}

TEST(NoiseFloor, IsTheDeviationOfFilteredEffortNoise) {
  Scenario s = long_drive();
  s.sensors.effort = 0.2;
  expect_floor(s, "Gaussian");
  // (1, −3, 3, −1) of uniform numbers has the excess kurtosis −1.2 · 164/400, which moves the median of its size by 5
  // %.
  s.sensors.noise = sim::NoiseShape::uniform;
  expect_floor(s, "uniform", 1.05);
}

TEST(NoiseFloor, IsTheDeviationOfFilteredEffortNoiseWhereEffortsAreHeld) {
  Scenario s = long_drive(Hold::zero_order);
  s.sensors.effort = 0.2;
  expect_floor(s, "held");
}

TEST(NoiseFloor, IsWhatTheNoiseOfTheSpeedsMakesOfTheModel) {
  Scenario s = long_drive();
  s.sensors.wheel_speed = 0.05;
  expect_floor(s, "speeds");
  s.sensors.effort = 0.1;
  expect_floor(s, "both");
}

TEST(NoiseFloor, IsWhatEncoderCountsMakeOfTheModel) {
  Scenario s = long_drive();
  s.sensors.sampling = sim::Sampling::interval;
  s.sensors.encoder_counts_per_turn = 1024.0;
  expect_floor(s, "counts");
}

// Without noise the rows are wrong by what a signal that bends between its instants loses as a polygon.
TEST(NoiseFloor, IsTheErrorOfTheStepWhereThereIsNoNoise) {
  for (const double rate : {50.0, 100.0, 200.0}) {
    const Drive drive = drive_of_log(sim::simulate(simulated_drive(plain_robot(), 60.0, rate)), plain_robot());
    const Eigen::MatrixXd left = rows_of_log(drive);
    const Eigen::VectorXd floor = noise_floor(drive, signal_noise(drive), kBeta).efforts;
    for (Eigen::Index i = 0; i < 2; ++i) {
      const double rms = left.col(i).norm() / std::sqrt(static_cast<double>(left.rows()));
      EXPECT_NEAR(floor[i], rms, 0.1 * rms) << rate << " Hz, output " << i;
    }
    const Increments gap = pose_gap(drive, make_windows(drive));
    const auto rms_of = [](const Eigen::VectorXd& x) {
      return std::sqrt(x.squaredNorm() / static_cast<double>(x.size()));
    };
    const IncrementNoise seen{rms_of(gap.forward), rms_of(gap.lateral), rms_of(gap.yaw)};
    const IncrementNoise said = noise_floor(drive, signal_noise(drive), kBeta).increments;
    EXPECT_LE(seen.forward, said.forward);
    EXPECT_LE(seen.lateral, said.lateral);
    EXPECT_LE(seen.yaw, said.yaw);
    EXPECT_GE(seen.forward, 0.4 * said.forward);
    EXPECT_GE(seen.lateral, 0.4 * said.lateral);
    EXPECT_GE(seen.yaw, 0.4 * said.yaw);
  }
}

// Small |v1|, large |v2|: the mass is what the noise of the speeds lowers most.
Scenario slow_drive(double noise) {
  Scenario s = long_drive();
  s.trajectory.speed = 0.2;
  s.sensors.wheel_speed = noise;
  return s;
}

TEST(Attenuation, IsByWhichShareLeastSquaresUnderestimatesTheMass) {
  for (const double noise : {0.4, 1.0}) {
    const Drive noisy = drive_of_log(sim::simulate(slow_drive(noise)), plain_robot());
    const Drive clean = drive_of_log(sim::simulate(slow_drive(0.0)), plain_robot());
    const double mass = fit_base(clean, kBeta)[0], biased = fit_base(noisy, kBeta)[0];
    const double bias = 1.0 - biased / mass;
    EXPECT_NEAR(mass, 0.0975 * 21.0, 1e-3 * mass);
    EXPECT_GT(bias, 0.01);
    EXPECT_NEAR(attenuation(noisy, signal_noise(noisy), kBeta), bias, 0.2 * bias);
  }
}

TEST(Attenuation, ChoosesTheFilter) {
  const Drive drive = drive_of_log(sim::simulate(slow_drive(0.05)), plain_robot());
  SignalNoise noise = signal_noise(drive);
  double last = 1e9;
  for (const double times : {0.01, 0.3, 1.0, 3.0, 1000.0}) {
    SignalNoise more = noise;
    more.speed *= times;
    const double beta = choose_gap_beta(drive, more, 20.0);
    EXPECT_LE(beta, last);
    EXPECT_TRUE(beta == 2.0 || attenuation(drive, more, beta) < 1e-3);
    last = beta;
  }
  EXPECT_EQ(last, 2.0);
  noise.speed *= 1e-3;
  EXPECT_EQ(choose_gap_beta(drive, noise, 20.0), 20.0);
  EXPECT_EQ(choose_gap_beta(drive, noise, 10.0), 10.0);
  EXPECT_EQ(choose_gap_beta(drive, noise, 12.0), 10.0);
}

TEST(SignalNoise, ForgetsMotionAndJumps) {
  Scenario s = long_drive();
  s.duration = 120.0;
  s.sensors.effort = 0.3;
  LogTable log = sim::simulate(s);
  const Drive plain = drive_of_log(log, plain_robot());
  const auto column =
      static_cast<std::size_t>(std::find(log.names.begin(), log.names.end(), "tau_r") - log.names.begin());
  for (std::size_t k = 0; k < log.t.size(); k += 100) {
    log.columns[column][k] += 50.0;
  }
  const Drive jumps = drive_of_log(log, plain_robot());
  const double sigma = signal_noise(plain).effort[0];
  EXPECT_NEAR(signal_noise(jumps).effort[0], sigma, 0.06 * sigma);
}

}  // namespace
}  // namespace wheelwright::gap::noise_floor_test

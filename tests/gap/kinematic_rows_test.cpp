// SPDX-License-Identifier: Apache-2.0
// Oracle: a robot on a circle, whose chords are known in closed form.
#include "gap/rows/gap_rows.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace wheelwright::gap::kinematic_rows_test {
namespace {

constexpr double kR = 0.1, kD = 0.4, kV = 0.5, kW = 0.8, kStep = 0.005;

// The wheels say v = kV, ω = kW; the pose moves by `share` of that, and sideways with `lateral`.
Drive circle(double share, double lateral, double noise = 0.0, int rows = 2000) {
  std::mt19937_64 rng(3);
  std::normal_distribution<double> normal(0.0, 1.0);
  LogTable log;
  log.names = {"omega_r", "omega_l", "tau_r", "tau_l", "x", "y", "theta"};
  log.columns.resize(7);
  log.segment_starts = {0, 1010};
  for (int k = 0; k < rows; ++k) {
    const double t = kStep * k, heading = share * kW * t, v = share * kV, w = share * kW;
    const std::vector<double> row{(kV + 0.5 * kD * kW) / kR,
                                  (kV - 0.5 * kD * kW) / kR,
                                  0.0,
                                  0.0,
                                  (v * std::sin(heading) + lateral * std::cos(heading)) / w + noise * normal(rng),
                                  (-v * std::cos(heading) + lateral * std::sin(heading)) / w + noise * normal(rng),
                                  heading + noise * normal(rng)};
    log.t.push_back(t);
    for (std::size_t c = 0; c < row.size(); ++c) {
      log.columns[c].push_back(row[c]);
    }
  }
  Robot robot;
  robot.wheel_radius = kR;
  robot.track_width = kD;
  Measurement measurement;
  measurement.motion_columns = {"omega_r", "omega_l"};
  measurement.effort_columns = {"tau_r", "tau_l"};
  return make_drive(log, robot, measurement);
}

TEST(KinematicRows, WindowsDoNotCrossSegments) {
  const Windows windows = make_windows(circle(1.0, 0.0), 0.5);  // 100 steps
  EXPECT_EQ(windows.size(), 9U + 9U);
  EXPECT_EQ(windows.reach, 25);
  for (std::size_t k = 0; k < windows.size(); ++k) {
    EXPECT_EQ(windows.last[k] - windows.first[k], 100);
    EXPECT_EQ(windows.first[k] - windows.reach < 1010, windows.last[k] + windows.reach < 1010);
  }
}

TEST(KinematicRows, AMissingShareOfTheMotionIsTheChordThatIsMissing) {
  const Drive drive = circle(0.9, 0.03);
  const Windows windows = make_windows(drive, 0.5);
  const Increments gap = pose_gap(drive, windows);
  // The integral of cos(ω s) from −W/2 to W/2, W = 0.5 s, its ends the means of 51 rows: Dirichlet's kernel.
  const double w = 0.9 * kW, mean = std::sin(25.5 * w * kStep) / (51.0 * std::sin(0.5 * w * kStep));
  const double chord = 2.0 * std::sin(0.25 * w) / w * mean;
  for (Eigen::Index k = 0; k < gap.forward.size(); ++k) {
    EXPECT_NEAR(gap.forward[k], (0.9 * kV - kV) * chord, 1e-6);
    EXPECT_NEAR(gap.lateral[k], 0.03 * chord, 1e-6);
    EXPECT_NEAR(gap.yaw[k], -0.1 * kW * 0.5, 1e-9);
  }
  Column column;
  column.forward = Eigen::VectorXd::Constant(drive.rows(), -0.1 * kV);
  column.lateral = Eigen::VectorXd::Constant(drive.rows(), 0.03);
  column.yaw = Eigen::VectorXd::Constant(drive.rows(), -0.1 * kW);
  const Increments seen = increments_of(drive, windows, column);
  EXPECT_LE((seen.forward - gap.forward).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LE((seen.lateral - gap.lateral).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LE((seen.yaw - gap.yaw).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(KinematicRows, NoiseOfThePoseIsFound) {
  const Drive drive = circle(1.0, 0.0, 0.004);
  const IncrementNoise noise = pose_noise(drive);
  EXPECT_NEAR(noise.forward, std::sqrt(2.0) * 0.004, 0.0006);
  EXPECT_NEAR(noise.yaw, std::sqrt(2.0) * 0.004, 0.0006);
  const Windows windows = make_windows(drive, 0.1);
  const IncrementNoise averaged = pose_noise(drive, windows.reach);
  EXPECT_DOUBLE_EQ(averaged.yaw, noise.yaw / std::sqrt(11.0));
  const Eigen::VectorXd yaw = pose_gap(drive, windows).yaw;
  EXPECT_NEAR(std::sqrt(yaw.squaredNorm() / static_cast<double>(yaw.size())), averaged.yaw, 0.25 * averaged.yaw);
}

TEST(KinematicRows, WithoutAPositionOnlyYawIsLeft) {
  Drive drive = circle(0.9, 0.0);
  drive.x.resize(0);
  drive.y.resize(0);
  const Windows windows = make_windows(drive);
  EXPECT_EQ(pose_gap(drive, windows).forward.size(), 0);
  EXPECT_EQ(pose_gap(drive, windows).yaw.size(), static_cast<Eigen::Index>(windows.size()));
  drive.heading.resize(0);
  EXPECT_EQ(pose_gap(drive, windows).yaw.size(), 0);
}

// The same motion throughout: what is always missing is repeated, and only the noise of two poses differs.
TEST(KinematicRows, RepeatedMotionShowsTheNoiseAndNotWhatIsMissing) {
  constexpr double noise = 2e-3;
  const Drive drive = circle(0.9, 0.03, noise, 40000);
  const Windows windows = make_windows(drive, 0.5);
  const IncrementNoise found = repeatability(drive, windows, pose_gap(drive, windows));
  const double averaged = std::sqrt(2.0 / (2.0 * static_cast<double>(windows.reach) + 1.0)) * noise;
  for (const double value : {found.forward, found.lateral, found.yaw}) {
    EXPECT_NEAR(value, averaged, 0.15 * averaged);
  }
  const IncrementNoise too_few = repeatability(drive, windows, pose_gap(drive, windows), windows.size() + 1);
  EXPECT_EQ(too_few.yaw, 0.0);
}

}  // namespace
}  // namespace wheelwright::gap::kinematic_rows_test

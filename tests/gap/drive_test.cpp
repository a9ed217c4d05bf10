// SPDX-License-Identifier: Apache-2.0
#include "gap/rows/drive.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"

namespace wheelwright::gap::drive_test {
namespace {

Robot axis() {
  Robot robot;
  robot.model = "single_axis";
  return robot;
}

Measurement measurement() {
  Measurement m;
  m.motion_columns = {"velocity"};
  m.effort_columns = {"effort"};
  return m;
}

template <typename Speed, typename Effort>
LogTable log_of(const std::vector<double>& t, const Speed& speed, const Effort& effort) {
  LogTable log;
  log.names = {"velocity", "effort"};
  log.columns.resize(2);
  log.t = t;
  for (const double at : t) {
    log.columns[0].push_back(speed(at));
    log.columns[1].push_back(effort(at));
  }
  return log;
}

std::vector<double> even(int n, double step) {
  std::vector<double> t;
  for (int k = 0; k < n; ++k) t.push_back(1.0 + step * k);
  return t;
}

TEST(Drive, SmoothingIsExactOnQuadraticsUpToTheEnds) {
  const auto quadratic = [](double t) { return 2.0 - 3.0 * t + 0.5 * t * t; };
  const Drive drive = make_drive(log_of(even(200, 0.01), quadratic, quadratic), axis(), measurement());
  EXPECT_EQ(drive.window, 7U);
  for (Eigen::Index k = 0; k < drive.rows(); ++k) {
    EXPECT_NEAR(drive.joints[0].smooth_speed[k], quadratic(drive.t[k]), 1e-10);
    EXPECT_NEAR(drive.joints[0].smooth_acceleration[k], drive.t[k] - 3.0, 1e-8);
    EXPECT_NEAR(drive.joints[0].smooth_effort[k], quadratic(drive.t[k]), 1e-10);
  }
}

TEST(Drive, UnevenStepsAreResampledAtTheMedianStep) {
  std::vector<double> t = even(300, 0.01);
  for (std::size_t k = 1; k + 1 < t.size(); k += 3) t[k] += 0.002;
  const auto line = [](double at) { return 4.0 * at - 1.0; };
  const Drive drive = make_drive(log_of(t, line, line), axis(), measurement());
  EXPECT_EQ(drive.resampled, 300U);
  EXPECT_EQ(drive.t[0], 1.0);
  for (Eigen::Index k = 0; k < drive.rows(); ++k) {
    EXPECT_NEAR(drive.t[k], 1.0 + drive.step * static_cast<double>(k), 1e-9);
    EXPECT_NEAR(drive.joints[0].speed[k], line(drive.t[k]), 1e-9);
  }
}

TEST(Drive, MeanSpeedsAreWholeCountsAndUnsignedEffortsTakeTheSignOfMotion) {
  Measurement counted = measurement();
  counted.motion = MotionKind::mean_speed;
  counted.count = 0.25;
  counted.effort_unsigned = true;
  const Drive drive =
      make_drive(log_of(
                     even(100, 0.01), [](double t) { return std::round(20.0 * std::sin(9.0 * t)) * 0.25 + 0.01; },
                     [](double) { return 2.0; }),
                 axis(), counted);
  for (Eigen::Index k = 0; k < drive.rows(); ++k) {
    const double counts = drive.joints[0].speed[k] / 0.25;
    EXPECT_EQ(counts, std::round(counts));
    if (drive.joints[0].speed[k] != 0.0) {
      EXPECT_EQ(drive.joints[0].effort[k], drive.joints[0].speed[k] > 0.0 ? 2.0 : -2.0);
    }
  }
}

TEST(Drive, AJointRestsWhereItStandsLongEnough) {
  const auto stops = [](double t) { return t < 2.0 ? std::sin(4.0 * t) : (t < 3.0 ? 0.0 : std::sin(4.0 * t)); };
  const Drive drive = make_drive(log_of(even(400, 0.01), stops, stops), axis(), measurement());
  EXPECT_TRUE(drive.joints[0].resting[150]);  // t = 2.5
  EXPECT_FALSE(drive.joints[0].resting[50]);  // moves
  EXPECT_FALSE(drive.joints[0].resting[57]);  // sin 4t passes through zero at t = 1.571
  const Mask mask = moving(drive, 20.0);
  EXPECT_FALSE(mask[150]);
  EXPECT_TRUE(mask[60]);
  EXPECT_TRUE(mask[399]);
}

// A sine of 5 rad/s that stands still for a second of eight, read by encoders from fine to coarse: neither a count a
// step nor the rounding of one is rest.
TEST(Drive, ACoarseEncoderThatTurnsDoesNotRest) {
  const double turn = 2.0 * std::acos(-1.0);
  const auto angle = [](double t) {
    const double driven = t < 4.0 ? t : std::max(4.0, t - 1.0);
    return 2.5 * driven - std::sin(driven);
  };
  for (const double counts : {100.0, 400.0, 800.0, 2048.0, 32768.0}) {
    for (const double rate : {20.0, 100.0, 500.0}) {
      for (const bool speeds : {false, true}) {
        const double h = 1.0 / rate, count = turn / counts;
        const auto counted = [&](double t) { return std::floor(angle(t) / count) * count; };
        const auto moved = [&](double t) { return (counted(t) - counted(t - h)) / h; };
        Measurement of = measurement();
        of.motion = speeds ? MotionKind::mean_speed : MotionKind::angle;
        of.count = speeds ? count * rate : 0.0;
        const std::vector<double> t = even(static_cast<int>(8.0 * rate), h);
        const LogTable log = speeds ? log_of(t, moved, moved) : log_of(t, counted, counted);
        const Drive drive = make_drive(log, axis(), of);
        const Mask& rest = drive.joints[0].resting;
        double wrong = 0.0, missed = 0.0;
        for (Eigen::Index k = 0; k < drive.rows(); ++k) {
          wrong += rest[k] && (drive.t[k] < 3.7 || drive.t[k] > 5.3) ? 1.0 : 0.0;
          missed += !rest[k] && drive.t[k] > 4.1 && drive.t[k] < 4.9 ? 1.0 : 0.0;
        }
        EXPECT_EQ(wrong, 0.0) << counts << " at " << rate << (speeds ? " speeds" : " angles");
        EXPECT_EQ(missed, 0.0) << counts << " at " << rate << (speeds ? " speeds" : " angles");
      }
    }
  }
}

TEST(Drive, PredictedEffortIsTheModelOnTheSmoothMotion) {
  const auto speed = [](double t) { return 1.0 + 2.0 * t; };
  Drive drive = make_drive(log_of(even(100, 0.01), speed, speed), axis(), measurement());
  ASSERT_EQ(drive.model.parameters[0].physical, "inertia");
  Eigen::VectorXd theta = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(drive.model.p()));
  theta[0] = 3.0;
  theta[1] = 0.5;
  predict_efforts(drive, theta);
  for (Eigen::Index k = 0; k < drive.rows(); ++k) {
    EXPECT_NEAR(drive.joints[0].predicted_effort[k], 6.0 + 0.5 * speed(drive.t[k]), 1e-9);
  }
  EXPECT_EQ(drive.physical("inertia"), 3.0);
  EXPECT_EQ(drive.physical("no such thing"), 0.0);
}

TEST(Drive, MisuseIsRefused) {
  const auto zero = [](double) { return 0.0; };
  LogTable log = log_of(even(10, 0.01), zero, zero);
  EXPECT_THROW((void)make_drive(core::slice(log, 0, 2), axis(), measurement()), InvalidArgument);
  log.names[1] = "torque";
  EXPECT_THROW((void)make_drive(log, axis(), measurement()), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::gap::drive_test

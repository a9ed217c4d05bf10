// SPDX-License-Identifier: Apache-2.0
// Oracle: RegressorFilter on the same log.
#include <wheelwright/gap/drive_filter.hpp>

#include <cmath>

#include <gtest/gtest.h>

#include <wheelwright/filter/regressor_filter.hpp>

namespace wheelwright::drive_filter_test {
namespace {

constexpr double kStep = 0.01, kBeta = 8.0;

Robot robot() {
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  robot.anisotropic_friction = true;  // terms that are functions of speed and heading
  return robot;
}

// Two segments, with a jump between.
LogTable log_of(MotionKind kind) {
  LogTable log;
  log.names = {"m_r", "m_l", "tau_r", "tau_l", "theta"};
  log.columns.resize(5);
  log.segment_starts = {0, 500};
  for (int k = 0; k < 900; ++k) {
    const double t = kStep * k + (k < 500 ? 0.0 : 3.0);
    log.t.push_back(t);
    const bool angle = kind == MotionKind::angle;
    log.columns[0].push_back(angle ? 2.0 * t - std::cos(2.0 * t) : 2.0 + 2.0 * std::sin(2.0 * t));
    log.columns[1].push_back(angle ? t + std::sin(3.0 * t) : 1.0 + 3.0 * std::cos(3.0 * t));
    log.columns[2].push_back(std::sin(1.3 * t) + 0.2 * std::cos(17.0 * t));
    log.columns[3].push_back(std::cos(2.3 * t));
    log.columns[4].push_back(0.5 * std::sin(0.4 * t));
  }
  return log;
}

Measurement measurement_of(MotionKind kind, Hold hold) {
  Measurement m;
  m.motion = kind;
  m.motion_columns = {"m_r", "m_l"};
  m.effort_columns = {"tau_r", "tau_l"};
  m.heading_column = "theta";
  m.hold = hold;
  return m;
}

void expect_rows_of_the_regressor_filter(MotionKind kind, Hold hold) {
  const LogTable log = log_of(kind);
  const Measurement measurement = measurement_of(kind, hold);
  const Drive drive = make_drive(log, robot(), measurement);
  const auto outputs = filtered_outputs(drive, kBeta);
  const auto rows = filtered_regressor(drive, kBeta);
  RegressorFilter filter(drive.model, {.order = 2, .alpha = kBeta, .beta = kBeta, .settle = 0.0}, measurement);
  Eigen::Index at = -1;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    if (k == log.segment_starts[1]) {
      filter.restart();
    }
    const std::vector<double> sample{log.columns[0][k], log.columns[1][k], log.columns[2][k], log.columns[3][k],
                                     log.columns[4][k]};
    const bool first = k == 0 || k == log.segment_starts[1];
    at += kind == MotionKind::angle && first ? 0 : 1;
    if (!filter.step(log.t[k], sample)) {
      continue;
    }
    ASSERT_NEAR(drive.t[at], filter.instant(), 1e-9);
    for (Eigen::Index i = 0; i < 2; ++i) {
      ASSERT_NEAR(outputs[static_cast<std::size_t>(i)][at], filter.row().y[i], 1e-9);
      for (Eigen::Index p = 0; p < static_cast<Eigen::Index>(drive.model.p()); ++p) {
        const Eigen::VectorXd& column = rows[static_cast<std::size_t>(p)][static_cast<std::size_t>(i)];
        ASSERT_NEAR(column.size() > 0 ? column[at] : 0.0, filter.row().Y(i, p), 1e-9) << "row " << at;
      }
    }
  }
  EXPECT_EQ(at + 1, drive.rows());
}

TEST(DriveFilter, GivesTheRowsOfTheRegressorFilter) {
  expect_rows_of_the_regressor_filter(MotionKind::speed, Hold::first_order);
  expect_rows_of_the_regressor_filter(MotionKind::speed, Hold::zero_order);
  expect_rows_of_the_regressor_filter(MotionKind::angle, Hold::first_order);
  expect_rows_of_the_regressor_filter(MotionKind::angle, Hold::zero_order);
}

TEST(DriveFilter, SettlesAfterItsMemoryInEachSegment) {
  const Drive drive =
      make_drive(log_of(MotionKind::speed), robot(), measurement_of(MotionKind::speed, Hold::first_order));
  const Mask mask = settled(drive, kBeta, 9.96);  // 1.245 s: 125 steps
  EXPECT_FALSE(mask[124]);
  EXPECT_TRUE(mask[125]);
  EXPECT_TRUE(mask[499]);
  EXPECT_FALSE(mask[500]);
  EXPECT_TRUE(mask[625]);
  EXPECT_EQ(mask.count(), 375 + 275);
}

TEST(DriveFilter, AConstantKeepsItsValueAndItsRateIsZero) {
  const Drive drive =
      make_drive(log_of(MotionKind::speed), robot(), measurement_of(MotionKind::speed, Hold::first_order));
  const Eigen::VectorXd three = Eigen::VectorXd::Constant(drive.rows(), 3.0);
  EXPECT_NEAR(filtered(drive, kBeta, three)[499], 3.0, 1e-12);
  EXPECT_EQ(filtered_rate(drive, kBeta, three).cwiseAbs().maxCoeff(), 0.0);
  const Eigen::VectorXd ramp = 2.0 * drive.t;
  EXPECT_NEAR(filtered_rate(drive, kBeta, ramp)[499], 2.0, 1e-12);
}

}  // namespace
}  // namespace wheelwright::drive_filter_test

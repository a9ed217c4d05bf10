// SPDX-License-Identifier: Apache-2.0
// Oracles: the convolution integral; RegressorFilter on the same log as the step goes to zero.
#include "gap/rows/drive.hpp"

#include <array>
#include <cmath>
#include <functional>

#include <gtest/gtest.h>

#include "model/filter/regressor_filter.hpp"

namespace wheelwright::gap::drive_filter_test {
namespace {

constexpr double kStep = 0.01, kBeta = 8.0, kSettle = 16.0;

Robot robot() {
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  robot.anisotropic_friction = true;  // terms that are functions of speed and heading
  return robot;
}

// Two segments, with a jump between.
LogTable log_of(MotionKind kind, double step = kStep) {
  LogTable log;
  log.names = {"m_r", "m_l", "tau_r", "tau_l", "theta"};
  log.columns.resize(5);
  const auto jump = static_cast<int>(std::lround(5.0 / step));
  log.segment_starts = {0, static_cast<std::size_t>(jump)};
  for (int k = 0; k < static_cast<int>(std::lround(9.0 / step)); ++k) {
    const double t = step * k + (k < jump ? 0.0 : 3.0);
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

// The rows of both filters at the same instants: RegressorFilter gives a step's row at its end, and for angles the
// drive's instant is the middle of the step.
struct Both {
  core::RowMatrix drive, regressor;  // instants × (y and Y of both outputs)
};

Both rows_of_both(MotionKind kind, Hold hold, double step) {
  const LogTable log = log_of(kind, step);
  Measurement measurement = measurement_of(kind, hold);
  measurement.nominal_step = step;
  const Drive drive = make_drive(log, robot(), measurement);
  const auto outputs = filtered_outputs(drive, kBeta);
  const auto rows = filtered_regressor(drive, kBeta);
  RegressorFilter filter(drive.model, {.order = 2, .alpha = kBeta, .beta = kBeta, .settle = kSettle}, measurement);
  const auto n = static_cast<Eigen::Index>(drive.model.n()), p = static_cast<Eigen::Index>(drive.model.p());
  Both both;
  both.drive.resize(drive.rows(), n * (p + 1));
  both.regressor.resize(drive.rows(), n * (p + 1));
  Eigen::Index at = -1, count = 0;
  for (std::size_t k = 0; k < log.rows(); ++k) {
    const bool first = k == 0 || k == log.segment_starts[1];
    if (first) {
      filter.restart();
    }
    std::vector<double> sample;
    for (const std::vector<double>& column : log.columns) {
      sample.push_back(column[k]);
    }
    at += kind == MotionKind::angle && first ? 0 : 1;
    if (!filter.step(log.t[k], sample)) {
      continue;
    }
    const double before = kind == MotionKind::angle ? 0.5 * step : 0.0;
    EXPECT_NEAR(drive.t[at], filter.instant() - before, 1e-9);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Eigen::Index first_column = i * (p + 1);
      both.drive(count, first_column) = outputs[static_cast<std::size_t>(i)][at];
      both.regressor(count, first_column) = filter.row().y[i];
      for (Eigen::Index j = 0; j < p; ++j) {
        const Eigen::VectorXd& column = rows[static_cast<std::size_t>(j)][static_cast<std::size_t>(i)];
        both.drive(count, first_column + 1 + j) = column.size() > 0 ? column[at] : 0.0;
        both.regressor(count, first_column + 1 + j) = filter.row().Y(i, j);
      }
    }
    ++count;
  }
  EXPECT_EQ(at + 1, drive.rows());
  both.drive.conservativeResize(count, Eigen::NoChange);
  both.regressor.conservativeResize(count, Eigen::NoChange);
  return both;
}

// Both are quadrature rules of the second order for f₂ * y and f₂ * Y of the motion between the samples.
TEST(DriveFilter, ComesToTheRowsOfTheRegressorFilterAsTheStepSquared) {
  for (const MotionKind kind : {MotionKind::speed, MotionKind::angle}) {
    for (const Hold hold : {Hold::first_order, Hold::zero_order}) {
      const Both coarse = rows_of_both(kind, hold, kStep), fine = rows_of_both(kind, hold, 0.5 * kStep);
      ASSERT_GT(coarse.drive.rows(), 400);
      ASSERT_GT(fine.drive.rows(), 400);
      SCOPED_TRACE(::testing::Message() << "motion " << static_cast<int>(kind) << ", hold " << static_cast<int>(hold));
      for (Eigen::Index c = 0; c < coarse.drive.cols(); ++c) {
        const double size = coarse.drive.col(c).cwiseAbs().maxCoeff();
        const double apart = (coarse.drive.col(c) - coarse.regressor.col(c)).cwiseAbs().maxCoeff();
        const double nearer = (fine.drive.col(c) - fine.regressor.col(c)).cwiseAbs().maxCoeff();
        const double h = kBeta * kStep;
        EXPECT_LE(apart, 0.5 * h * h * size) << "column " << c;
        EXPECT_LE(nearer, 0.3 * apart + 1e-12 * size) << "column " << c;
      }
    }
  }
}

// ∫ β² x e^{−βx} u(t − x) dx over the segment, by Gauss and Legendre's rule with five points in each step.
double by_quadrature(const Drive& drive, const std::function<double(Eigen::Index, double)>& u, Eigen::Index at) {
  constexpr std::array kPoint{0.046910077030668, 0.230765344947158, 0.5, 0.769234655052842, 0.953089922969332};
  constexpr std::array kWeight{0.118463442528095, 0.239314335249683, 0.284444444444444, 0.239314335249683,
                               0.118463442528095};
  double sum = 0.0;
  for (Eigen::Index k = drive.segment(0).first; k < at; ++k) {
    for (std::size_t g = 0; g < kPoint.size(); ++g) {
      const double x = (static_cast<double>(at - k) - kPoint[g]) * drive.step;
      sum += kWeight[g] * drive.step * kBeta * kBeta * x * std::exp(-kBeta * x) * u(k, kPoint[g]);
    }
  }
  return sum;
}

TEST(DriveFilter, IsTheConvolutionOfWhatIsLinearOrHeld) {
  const Drive drive =
      make_drive(log_of(MotionKind::speed), robot(), measurement_of(MotionKind::speed, Hold::zero_order));
  const Eigen::VectorXd& speed = drive.coordinates[0].speed;
  const Eigen::VectorXd linear = filtered(drive, kBeta, speed), rate = filtered_rate(drive, kBeta, speed);
  const auto outputs = filtered_outputs(drive, kBeta);
  for (const Eigen::Index at : {1, 2, 40, 300}) {
    EXPECT_NEAR(linear[at],
                by_quadrature(
                    drive, [&](Eigen::Index k, double s) { return (1.0 - s) * speed[k] + s * speed[k + 1]; }, at),
                1e-12);
    EXPECT_NEAR(rate[at],
                by_quadrature(
                    drive, [&](Eigen::Index k, double) { return (speed[k + 1] - speed[k]) / drive.step; }, at),
                1e-11);
    for (Eigen::Index i = 0; i < 2; ++i) {
      EXPECT_NEAR(outputs[static_cast<std::size_t>(i)][at],
                  by_quadrature(
                      drive,
                      [&](Eigen::Index k, double) {
                        return drive.model.input(i, 0) * drive.joints[0].held_effort[k] +
                               drive.model.input(i, 1) * drive.joints[1].held_effort[k];
                      },
                      at),
                  1e-12);
    }
  }
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
}  // namespace wheelwright::gap::drive_filter_test

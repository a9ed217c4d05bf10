// SPDX-License-Identifier: Apache-2.0
// Efforts that a low-pass filter smoothed before they were logged: rows made of them are those of the efforts that
// acted, within the bounds, for every time constant in the declared range, with lost rows and late efforts, too.
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/differential_drive.hpp"
#include "model/filter/row_stream.hpp"
#include "tests/filter/wheel_measurement.hpp"
#include "tests/support/lost_rows.hpp"

namespace wheelwright::filter::effort_smoothing_test {
namespace {

const DifferentialDrive kRobot{.wheel_radius = 0.1, .track_width = 0.4};
constexpr double kStep = 0.01;

// Torques that jump at random, and motion that has nothing to do with them: of the rows' torque alone is asked.
LogTable random_log(MotionKind motion, std::size_t rows, unsigned seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  LogTable log;
  log.names = {motion == MotionKind::angle ? "phi_r" : "omega_r", motion == MotionKind::angle ? "phi_l" : "omega_l",
               "tau_r", "tau_l"};
  log.columns.resize(4);
  double torque[2] = {0.0, 0.0};
  for (std::size_t k = 0; k < rows; ++k) {
    const double t = static_cast<double>(k) * kStep;
    log.t.push_back(t);
    log.columns[0].push_back(std::sin(t));
    log.columns[1].push_back(std::cos(0.7 * t));
    for (std::size_t j = 0; j < 2; ++j) {
      torque[j] += rng() % 5 == 0 ? normal(rng) : 0.0;
      log.columns[2 + j].push_back(torque[j]);
    }
  }
  return log;
}

LogTable smoothed(LogTable log, double time) {
  const double a = 1.0 - std::exp(-kStep / time);
  for (std::size_t c = 2; c < 4; ++c) {
    double y = log.columns[c].front();
    for (double& u : log.columns[c]) {
      u = y += a * (u - y);
    }
  }
  return log;
}

LogTable without_every(const LogTable& log, std::size_t nth) {
  return testing_support::without_rows(log, [&](std::size_t k) { return k % nth == nth / 2; });
}

Measurement measurement(MotionKind motion, Hold hold, Interval smoothing) {
  Measurement m = wheels(motion, hold);
  m.changes = model::EffortChanges::at_samples;
  m.nominal_step = kStep;
  m.smoothing = smoothing;
  return m;
}

RegressionBlock rows_of(const LogTable& log, const Measurement& m) {
  SignalErrors errors;
  errors.acceleration = errors.speed = errors.speed_sample = errors.output = Eigen::VectorXd::Zero(2);
  errors.motion.effort = Eigen::VectorXd::Zero(2);
  errors.bridges = true;
  TableSource source(log);
  TorqueRows stream(source, RegressorFilter(kRobot.model(), {.order = 2, .alpha = 6.0, .beta = 6.0}, m, errors));
  return read_all(stream);
}

constexpr double kNearly = 0.02 * kStep;  // a time constant that smooths nothing, and leaves out the same rows

TEST(EffortSmoothing, IsUndoneExactlyWhereItIsKnown) {
  for (const MotionKind motion : {MotionKind::angle, MotionKind::speed}) {
    for (const Hold hold : {Hold::zero_order, Hold::first_order}) {
      for (const double time : {0.002, 0.005, 0.02, 0.1}) {
        SCOPED_TRACE(time);
        const LogTable acted = random_log(motion, 1500, 3);
        const RegressionBlock sharp = rows_of(smoothed(acted, time), measurement(motion, hold, {time, time}));
        const RegressionBlock truth = rows_of(acted, measurement(motion, hold, {kNearly, kNearly}));
        ASSERT_EQ(sharp.t, truth.t);
        ASSERT_GT(sharp.instants(), 500U);
        EXPECT_LT((sharp.y - truth.y).cwiseAbs().maxCoeff(), 1e-9 * truth.y.cwiseAbs().maxCoeff());
      }
    }
  }
}

// The time constant is anywhere in the range, its ends included; rows are lost after the filter.
TEST(EffortSmoothing, DoubtHoldsTheEffortsThatActed) {
  const Interval range{0.004, 0.012};
  for (const MotionKind motion : {MotionKind::angle, MotionKind::speed}) {
    for (const Hold hold : {Hold::zero_order, Hold::first_order}) {
      for (const std::size_t lost_every : {100000U, 41U}) {
        for (const double time : {0.004, 0.007, 0.012}) {
          const LogTable acted = random_log(motion, 1500, 5);
          const RegressionBlock found =
              rows_of(without_every(smoothed(acted, time), lost_every), measurement(motion, hold, range));
          const RegressionBlock truth =
              rows_of(without_every(acted, lost_every), measurement(motion, hold, {kNearly, kNearly}));
          ASSERT_EQ(found.t, truth.t);
          ASSERT_GT(found.instants(), 500U);
          const Eigen::VectorXd off = (found.y - truth.y).cwiseAbs() - found.dy;
          EXPECT_LT(off.maxCoeff(), 1e-12 * truth.y.cwiseAbs().maxCoeff()) << time;
        }
        // A time constant outside of the range is not covered.
        const LogTable acted = random_log(motion, 1500, 5);
        const RegressionBlock found =
            rows_of(without_every(smoothed(acted, 0.04), lost_every), measurement(motion, hold, range));
        const RegressionBlock truth =
            rows_of(without_every(acted, lost_every), measurement(motion, hold, {kNearly, kNearly}));
        EXPECT_GT(((found.y - truth.y).cwiseAbs() - found.dy).maxCoeff(), 0.0);
      }
    }
  }
}

TEST(EffortSmoothing, NeedsALogOfOneRateAndEffortsWithASign) {
  Measurement m = measurement(MotionKind::angle, Hold::zero_order, {0.005, 0.005});
  m.nominal_step = 0.0;
  EXPECT_THROW(RegressorFilter(kRobot.model(), {}, m), InvalidArgument);
  m.nominal_step = kStep;
  m.effort_unsigned = true;
  EXPECT_THROW(RegressorFilter(kRobot.model(), {}, m), InvalidArgument);
  m.effort_unsigned = false;
  m.smoothing = {0.01, 0.005};
  EXPECT_THROW(RegressorFilter(kRobot.model(), {}, m), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::filter::effort_smoothing_test

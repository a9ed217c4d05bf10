// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "commission/identification.hpp"
#include "core/error.hpp"
#include "identify/time_shift.hpp"
#include "tests/support/drives.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::identify::time_shift_test {
namespace {

using testing_support::Autoregression;
using testing_support::block_of;
using testing_support::exact_drive;
using testing_support::filter_of;
using testing_support::Random;
using testing_support::Shown;

// Two columns of two sines each at 100 Hz, two outputs, and the effort that 2 and −3 times them ask for, where each
// sine went through `gain` and `phase` (rad) of its frequency: the steady state of any linear effect.
template <typename Gain, typename Phase>
RegressionBlock sines(std::size_t instants, Gain gain, Phase phase, double noise = 0.0, std::uint64_t seed = 1) {
  Eigen::MatrixXd Y(static_cast<Eigen::Index>(2 * instants), 2);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(Y.rows());
  Autoregression errors(seed, 0.9);
  const double frequency[2][2][2] = {{{2.0, 5.0}, {1.0, 4.0}}, {{3.0, 1.5}, {6.0, 0.7}}};  // output, column, sine
  for (Eigen::Index row = 0; row < Y.rows(); ++row) {
    const double t = 0.01 * static_cast<double>(row / 2);
    for (Eigen::Index j = 0; j < 2; ++j) {
      Y(row, j) = 0.0;
      for (int k = 0; k < 2; ++k) {
        const double w = frequency[row % 2][j][k];
        Y(row, j) += std::sin(w * t + static_cast<double>(j));
        y[row] += (j == 0 ? 2.0 : -3.0) * gain(w) * std::sin(w * t + static_cast<double>(j) + phase(w));
      }
    }
    y[row] += noise * errors.next();
  }
  return block_of(Y, y, 2);
}

void expect_found(const SeparableFit& fit, double shift, double tolerance) {
  ASSERT_EQ(fit.end, SearchEnd::converged);
  EXPECT_EQ(fit.state[0], ShapeState::identified);
  EXPECT_NEAR(fit.shape[0], shift, tolerance);
  EXPECT_NEAR(fit.linear[0], 2.0, 20.0 * tolerance);
  EXPECT_NEAR(fit.linear[1], -3.0, 20.0 * tolerance);
}

double one(double) { return 1.0; }

TEST(TimeShift, DelayOfSinesIsFoundInEitherDirection) {
  for (const double delay : {0.0437, -0.0213, 0.08}) {
    const RegressionBlock rows = sines(600, one, [&](double w) { return -w * delay; });
    const TimeShiftedRows model(rows, TimeEffect::delay, -0.1, 0.1);
    // Interpolation is right to h⁴w⁴/… : some 1e-6 of a sine.
    expect_found(variable_projection(model, model.options()), delay, 1e-5);
  }
}

// The search may end early: the steps on the gradient alone find the remaining digits.
TEST(TimeShift, ASearchThatEndsEarlyFindsTheSameDigits) {
  for (const double noise : {0.0, 0.1}) {
    const RegressionBlock rows = sines(
        600, one, [](double w) { return -0.0437 * w; }, noise);
    const TimeShiftedRows model(rows, TimeEffect::delay, -0.1, 0.1);
    VariableProjectionOptions options = model.options();
    const SeparableFit exact = variable_projection(model, options);
    options.flat = 1e-6;
    const SeparableFit early = variable_projection(model, options);
    EXPECT_EQ(early.end, SearchEnd::converged);
    EXPECT_LT(early.iterations, exact.iterations);
    EXPECT_NEAR(early.shape[0], exact.shape[0], 1e-10);
    EXPECT_NEAR(early.standard_error[0], exact.standard_error[0], 1e-6 * exact.standard_error[0]);
  }
}

TEST(TimeShift, LagOfTheEffortIsFound) {
  for (const double T : {0.003, 0.05, 0.2}) {
    const RegressionBlock rows = sines(
        800, [&](double w) { return 1.0 / std::hypot(1.0, w * T); }, [&](double w) { return -std::atan(w * T); });
    const TimeShiftedRows model(rows, TimeEffect::effort_lag, 0.0, 0.5);
    // Linear between samples is right to (wh)²/12 of a sine: 3e-4 at most. The first six time constants are left out.
    expect_found(variable_projection(model, model.options()), T, 2e-4);
  }
}

TEST(TimeShift, LagOfTheActuatorIsFound) {
  for (const double T : {0.02, 0.1}) {
    const RegressionBlock rows = sines(
        800, [&](double w) { return std::hypot(1.0, w * T); }, [&](double w) { return std::atan(w * T); });
    const TimeShiftedRows model(rows, TimeEffect::actuator_lag, 0.0, 0.3);
    expect_found(variable_projection(model, model.options()), T, 2e-4);
  }
}

// Central differences of Φ agree with its derivative, for all effects, away from the sample grid's knots.
TEST(TimeShift, DerivativesAreThoseOfDifferences) {
  const RegressionBlock rows = sines(120, one, [](double) { return 0.0; });
  for (const TimeEffect effect : {TimeEffect::delay, TimeEffect::effort_lag, TimeEffect::actuator_lag}) {
    const TimeShiftedRows model(rows, effect, 0.0, 0.1);
    constexpr double kStep = 1e-6;
    for (const double T : {0.013, 0.0478, 0.08}) {
      SeparableValues at, before, after;
      ASSERT_TRUE(model.evaluate(Eigen::VectorXd::Constant(1, T), true, at));
      ASSERT_TRUE(model.evaluate(Eigen::VectorXd::Constant(1, T - kStep), false, before));
      ASSERT_TRUE(model.evaluate(Eigen::VectorXd::Constant(1, T + kStep), false, after));
      const Eigen::MatrixXd difference = (after.columns - before.columns) / (2.0 * kStep);
      EXPECT_LT((difference - at.columns_by[0]).cwiseAbs().maxCoeff(), 1e-6 * (1.0 + difference.cwiseAbs().maxCoeff()));
    }
  }
}

// 80 logs of 8 s with residuals of correlation 0.9 from sample to sample: honest intervals hold the truth at about
// their level, those of independent residuals do not.
TEST(TimeShift, IntervalsAreHonestUnderAutocorrelation) {
  int honest = 0;
  int naive = 0;
  constexpr int kRuns = 80;
  for (int k = 0; k < kRuns; ++k) {
    const RegressionBlock rows = sines(
        1200, one, [](double w) { return -0.03 * w; }, 0.3, static_cast<std::uint64_t>(1000 + k));
    const TimeShiftedRows model(rows, TimeEffect::delay, 0.0, 0.1);
    const SeparableFit fit = variable_projection(model, model.options());
    const double error = std::abs(fit.shape[0] - 0.03);
    const double t95 = 2.0 + 2.5 / fit.freedom;  // Student's quantile to 1 % from 8 degrees of freedom on
    honest += error <= t95 * fit.standard_error[0] ? 1 : 0;
    naive += error <= 1.96 * std::sqrt(fit.covariance_if_independent(0, 0)) ? 1 : 0;
  }
  EXPECT_GE(honest, 70);  // of 80 at 95 %: fewer than 70 has the probability 0.3 %
  EXPECT_LT(naive, honest);
}

TEST(TimeShift, NothingIsDrawnAcrossAGap) {
  const RegressionBlock whole = sines(700, one, [](double w) { return -0.05 * w; });
  RegressionBlock rows = whole;
  for (std::size_t k = 350; k < 700; ++k) {
    rows.sample[k] += 100;
    rows.t[k] += 1.0;
  }
  const TimeShiftedRows model(rows, TimeEffect::delay, 0.0, 0.1);
  EXPECT_EQ(model.instants().size(), 680U);  // ten instants of each segment look back too far
  expect_found(variable_projection(model, model.options()), 0.05, 1e-5);
}

TEST(TimeShift, AConstantTellsNoDelay) {
  const RegressionBlock rows = block_of(Eigen::MatrixXd::Ones(200, 1), Eigen::VectorXd::Constant(200, 2.0), 1);
  const TimeShiftedRows model(rows, TimeEffect::delay, 0.0, 0.1);
  const SeparableFit fit = variable_projection(model, model.options());
  EXPECT_EQ(fit.state[0], ShapeState::flat);
  EXPECT_FALSE(std::isfinite(fit.standard_error[0]));
  EXPECT_NEAR(fit.linear[0], 2.0, 1e-12);
}

TEST(TimeShift, ADelayOutsideItsBoundsStopsAtTheBound) {
  const RegressionBlock rows = sines(600, one, [](double w) { return -0.09 * w; });
  const TimeShiftedRows model(rows, TimeEffect::delay, 0.0, 0.05);
  const SeparableFit fit = variable_projection(model, model.options());
  EXPECT_EQ(fit.state[0], ShapeState::at_upper);
  EXPECT_EQ(fit.shape[0], 0.05);
  const auto curve = cost_curve(model, fit.shape, 0, 0.0, 0.05, 11);
  ASSERT_EQ(curve.size(), 11U);
  for (std::size_t k = 1; k < curve.size(); ++k) {
    EXPECT_LT(curve[k].weighted_rss, curve[k - 1].weighted_rss);
  }
  EXPECT_NEAR(curve.back().weighted_rss, fit.weighted_rss, 1e-9 * fit.weighted_rss);
}

TEST(TimeShift, RefusesMisuse) {
  const RegressionBlock rows = sines(20, one, [](double) { return 0.0; });
  EXPECT_THROW(TimeShiftedRows(rows, TimeEffect::delay, 0.1, 0.1), InvalidArgument);
  EXPECT_THROW(TimeShiftedRows(rows, TimeEffect::effort_lag, -0.1, 0.1), InvalidArgument);
  EXPECT_THROW(TimeShiftedRows(rows, TimeEffect::delay, 0.0, 10.0), InvalidArgument);
}

// Effort of a drive without noise, logged three samples late.
TEST(TimeShift, DelayOfASimulatedDriveIsFound) {
  const Scenario scenario = exact_drive(Shown::speeds, Hold::first_order);
  Simulation simulation(scenario);
  LogTable log = read_all(simulation);
  for (const char* name : {"tau_r", "tau_l"}) {
    std::vector<double>& effort = log.column(name);
    std::copy_backward(effort.begin(), effort.end() - 3, effort.end());
  }
  TableSource source(log);
  TorqueRows stream(source, filter_of(scenario));
  const TimeShiftedRows model(read_all(stream), TimeEffect::delay, -0.1, 0.1);
  const SeparableFit fit = variable_projection(model, model.options());
  const Eigen::VectorXd truth = sim::true_parameters(scenario, model::make_model(scenario.robot));
  EXPECT_NEAR(fit.shape[0], 0.03, 1e-4);
  for (Eigen::Index j = 0; j < truth.size(); ++j) {
    EXPECT_NEAR(fit.linear[j], truth[j], 2e-3 * std::abs(truth[j]));
  }
}

// c exp(−(|ω|/ω_s)²) sgn ω at both wheels is added to the effort of a drive without noise; efforts are linear between
// samples as the column is.
TEST(Stribeck, SpeedAndSizeAreFound) {
  for (const Shown shown : {Shown::speeds, Shown::angles}) {
    const Scenario scenario = exact_drive(shown, Hold::first_order);
    Scenario with_speeds = scenario;
    with_speeds.sensors.speeds = true;
    Simulation simulation(with_speeds);
    LogTable log = read_all(simulation);
    constexpr double kSize = 0.4;
    constexpr double kSpeed = 1.7;
    for (const char side : {'r', 'l'}) {
      const std::vector<double> speed = log.column(std::string("omega_") + side);
      std::vector<double>& effort = log.column(std::string("tau_") + side);
      for (std::size_t k = 0; k < effort.size(); ++k) {
        const double sign = static_cast<double>(speed[k] > 0.0) - static_cast<double>(speed[k] < 0.0);
        effort[k] += kSize * std::exp(-std::pow(speed[k] / kSpeed, 2.0)) * sign;
      }
    }
    TableSource source(log);
    const commission::StribeckRows model(source, filter_of(scenario));
    VariableProjectionOptions options;
    options.lower = Eigen::VectorXd::Constant(1, 0.05);
    options.upper = Eigen::VectorXd::Constant(1, 20.0);
    const SeparableFit fit = variable_projection(model, options);
    EXPECT_EQ(fit.end, SearchEnd::converged);
    EXPECT_EQ(fit.state[0], ShapeState::identified);
    // Between samples of the speed the drive's own speed is not linear: (βh)²/12 = 5e-4 of the inertia. With angles the
    // speeds are means over the steps, so that jumps at reversals are smeared too.
    const double tolerance = shown == Shown::speeds ? 5e-4 : 0.03;
    EXPECT_NEAR(fit.shape[0], kSpeed, tolerance * kSpeed);
    EXPECT_NEAR(fit.linear[fit.linear.size() - 1], kSize, tolerance * kSize);
    const Eigen::VectorXd truth = sim::true_parameters(scenario, model::make_model(scenario.robot));
    for (Eigen::Index j = 0; j < truth.size(); ++j) {
      EXPECT_NEAR(fit.linear[j], truth[j], tolerance * std::abs(truth[j]));
    }
  }
}

double size_at_1_7(double omega) {
  const double sign = static_cast<double>(omega > 0.0) - static_cast<double>(omega < 0.0);
  return sign * std::exp(-(omega / 1.7) * (omega / 1.7));
}
model::TermValue both(const model::MotionState& s) {
  return {size_at_1_7(s.joint_speed[0]) + size_at_1_7(s.joint_speed[1]), 0.0};
}
model::TermValue unlike(const model::MotionState& s) {
  return {size_at_1_7(s.joint_speed[0]) - size_at_1_7(s.joint_speed[1]), 0.0};
}

// The column at ω_s = 1.7 is `expected` and stands beside the plain rows; its slope is that of differences.
void expect_column(const commission::StribeckRows& rows, const RegressionBlock& plain,
                   const Eigen::VectorXd& expected) {
  SeparableValues at;
  ASSERT_TRUE(rows.evaluate(Eigen::VectorXd::Constant(1, 1.7), true, at));
  ASSERT_EQ(at.columns.rows(), expected.size());
  EXPECT_LT((at.columns.leftCols(plain.Y.cols()) - plain.Y).cwiseAbs().maxCoeff(), 1e-13);
  EXPECT_LT((at.columns.rightCols(1) - expected).cwiseAbs().maxCoeff(), 1e-13);
  constexpr double kStep = 1e-6;
  SeparableValues before, after;
  ASSERT_TRUE(rows.evaluate(Eigen::VectorXd::Constant(1, 1.7 - kStep), false, before));
  ASSERT_TRUE(rows.evaluate(Eigen::VectorXd::Constant(1, 1.7 + kStep), false, after));
  const Eigen::MatrixXd slope = (after.columns - before.columns) / (2.0 * kStep);
  EXPECT_LT((at.columns_by[0] - slope).cwiseAbs().maxCoeff(), 1e-8);
}

// With angles, the column at one ω_s is what RegressorFilter makes of a model that has this friction as a term.
TEST(Stribeck, ItsColumnIsThatOfTheRegressorFilter) {
  const Scenario scenario = exact_drive(Shown::angles, Hold::first_order);
  const RegressorFilter plain = filter_of(scenario);
  Model model = plain.model();
  model.parameters.push_back(
      {.name = "stribeck", .unit = "N·m", .physical = "stribeck", .physical_unit = "N·m", .prior = {}, .excite = {}});
  const std::size_t last = model.p() - 1;
  model.terms.push_back(
      {.output = 0, .parameter = last, .kind = Term::Kind::function, .scale = model.input(0, 0), .function = both});
  model.terms.push_back(
      {.output = 1, .parameter = last, .kind = Term::Kind::function, .scale = model.input(1, 0), .function = unlike});
  Simulation simulation(scenario);
  TorqueRows stream(simulation, RegressorFilter(model, plain.design(), plain.measurement()));
  const RegressionBlock with_term = read_all(stream);
  TorqueRows plain_stream(simulation, plain);
  const RegressionBlock rows = read_all(plain_stream);
  expect_column(commission::StribeckRows(simulation, plain), rows, with_term.Y.col(static_cast<Eigen::Index>(last)));
}

// With measured speeds it is what RegressorFilter makes of efforts of this size at the samples.
TEST(Stribeck, ItsColumnIsThatOfEffortsOfItsSize) {
  const Scenario scenario = exact_drive(Shown::speeds, Hold::first_order);
  const RegressorFilter plain = filter_of(scenario);
  Simulation simulation(scenario);
  LogTable log = read_all(simulation);
  TorqueRows plain_stream(simulation, plain);
  const RegressionBlock rows = read_all(plain_stream);
  for (const char side : {'r', 'l'}) {
    std::ranges::transform(log.column(std::string("omega_") + side), log.column(std::string("tau_") + side).begin(),
                           size_at_1_7);
  }
  TableSource of_its_size(log);
  TorqueRows stream(of_its_size, plain);
  const RegressionBlock friction = read_all(stream);
  expect_column(commission::StribeckRows(simulation, plain), rows, friction.y);
}

TEST(Stribeck, FastDrivingLeavesItsSpeedFlat) {
  // The wheels never go slower than 5 rad/s: nothing of exp(−(5/ω_s)²) is seen for the ω_s that are allowed.
  LogTable log;
  log.names = {"omega_r", "omega_l", "tau_r", "tau_l"};
  log.columns.resize(4);
  Random random(3);
  for (int k = 0; k < 800; ++k) {
    const double t = 0.01 * k;
    log.t.push_back(t);
    log.columns[0].push_back(8.0 + 2.0 * std::sin(2.0 * t));
    log.columns[1].push_back(8.0 + 2.0 * std::sin(3.0 * t));
    log.columns[2].push_back(1.0 + 0.3 * std::sin(2.0 * t) + 0.05 * random.normal());
    log.columns[3].push_back(1.0 + 0.3 * std::sin(3.0 * t) + 0.05 * random.normal());
  }
  TableSource source(log);
  const commission::StribeckRows model(source, filter_of(exact_drive(Shown::speeds, Hold::first_order)));
  VariableProjectionOptions options;
  options.lower = Eigen::VectorXd::Constant(1, 0.1);
  options.upper = Eigen::VectorXd::Constant(1, 1.0);
  const SeparableFit fit = variable_projection(model, options);
  EXPECT_NE(fit.state[0], ShapeState::identified);
}

}  // namespace
}  // namespace wheelwright::identify::time_shift_test

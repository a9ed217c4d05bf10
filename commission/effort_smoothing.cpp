// SPDX-License-Identifier: Apache-2.0
#include "commission/effort_smoothing.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/QR>

#include "commission/contradiction_search.hpp"
#include "commission/evidence.hpp"
#include "commission/setting_rows.hpp"
#include "core/error.hpp"
#include "core/statistics.hpp"
#include "identify/least_squares.hpp"
#include "identify/moments.hpp"
#include "identify/time_shift.hpp"

namespace wheelwright::commission {

namespace {

constexpr double kNearlySharp = 0.02;  // steps of a time constant: κ is e⁻⁵⁰
constexpr double kSignKnown = 0.02;    // of the largest sum of signs in a row
constexpr double kNoiseBound = 3.0;    // deviations of noise that is not declared
constexpr double kRiskOfLag = 1e-4;    // that a delay is taken for a filter, or a filter for a delay

// Rows with efforts sharpened by the filter of this time constant, s, with signs left open by noise.
RegressionBlock sharpened_rows(LogSource& log, Setting s, double time, std::size_t most_rows, bool bridges) {
  s.measurement.smoothing = {time, time};
  filter::SignalErrors errors = errors_of_fit(s);
  errors.bridges = bridges;
  TorqueRows stream = make_rows(log, s, errors);
  RegressionBlock rows = first_rows(stream, most_rows);
  log.rewind();
  return rows;
}

// Rows with κ next to 0, and with κ = 1.
struct TwoSharpenings {
  RegressionBlock rows, by_one;
};

// Nothing where there are too few, or not the same in both.
std::optional<TwoSharpenings> two_sharpenings(LogSource& log, const Setting& s, std::size_t most_rows, bool bridges) {
  const double step = s.survey.median_step;
  TwoSharpenings both{sharpened_rows(log, s, kNearlySharp * step, most_rows, bridges),
                      sharpened_rows(log, s, step / std::numbers::ln2, most_rows, bridges)};
  if (both.rows.t != both.by_one.t || both.rows.instants() < kFewestInstants) {
    return std::nullopt;
  }
  return both;
}

identify::ResidualSummary summary_of(const RegressionBlock& rows, const identify::LeastSquaresFit& fit,
                                     const Eigen::VectorXd& weights) {
  identify::ResidualStatistics statistics(fit.estimate, weights);
  statistics.add(rows);
  return statistics.summary(fit.inverse_gram);
}

// Weighted squares of what least squares leaves, instant by instant.
Eigen::VectorXd squares_left(Eigen::MatrixXd columns, Eigen::VectorXd y, const Eigen::VectorXd& weights) {
  const Eigen::Index n = weights.size();
  for (Eigen::Index r = 0; r < y.size(); ++r) {
    columns.row(r) *= weights[r % n];
    y[r] *= weights[r % n];
  }
  y -= columns * columns.colPivHouseholderQr().solve(y);
  Eigen::VectorXd left(y.size() / n);
  for (Eigen::Index k = 0; k < left.size(); ++k) {
    left[k] = y.segment(k * n, n).squaredNorm();
  }
  return left;
}

// The setting with all parameters that the robot may have, and efforts as logged.
Setting as_logged(const Setting& s) {
  Setting wide = s;
  wide.measurement.delay = {0.0, 0.0};
  wide.robot.parameters = model::possible_parameters(s.robot);
  wide.model = model::make_model(wide.robot);
  if (wide.declared.joint_sample == 0.0 && s.motion_noise) {
    const bool angles = s.measurement.motion != MotionKind::speed;
    wide.declared.joint_sample = kNoiseBound * s.motion_noise->sd * (angles ? 2.0 / s.measurement.nominal_step : 1.0);
  }
  return wide;
}

}  // namespace

double EffortSmoothing::time_constant(double sharpening, double step) {
  return sharpening > 0.0 ? step / std::log1p(1.0 / sharpening) : 0.0;
}

std::optional<EffortSmoothing> effort_smoothing(LogSource& log, const Setting& s, const Fit& fit,
                                                std::size_t most_rows) {
  if (s.measurement.effort_unsigned || !s.measurement.correction.empty()) {
    return std::nullopt;
  }
  const Setting wide = as_logged(s);
  const std::optional<TwoSharpenings> both = two_sharpenings(log, wide, most_rows, true);
  if (!both) {
    return std::nullopt;
  }
  const auto& [rows, by_one] = *both;
  // One more column: what κ = 1 adds to the efforts.
  const auto n = static_cast<Eigen::Index>(rows.outputs), p = static_cast<Eigen::Index>(rows.parameters);
  Eigen::VectorXd open = Eigen::VectorXd::Zero(rows.rows());
  for (std::size_t j = 0; j < rows.parameters; ++j) {
    if (wide.model.parameters[j].dry_friction) {
      const auto at = static_cast<Eigen::Index>(j);
      const double largest = rows.Y.col(at).cwiseAbs().maxCoeff();
      open += rows.dY.col(at) / (largest > 0.0 ? largest : 1.0);
    }
  }
  RegressionBlock wider;
  wider.resize(rows.instants(), rows.outputs, rows.parameters + 1);
  std::size_t kept = 0;
  for (std::size_t k = 0; k < rows.instants(); ++k) {
    const auto from = static_cast<Eigen::Index>(k) * n, to = static_cast<Eigen::Index>(kept) * n;
    if (open.segment(from, n).maxCoeff() > kSignKnown) {
      continue;
    }
    wider.sample[kept] = rows.sample[k];
    wider.t[kept] = rows.t[k];
    wider.Y.block(to, 0, n, p) = rows.Y.middleRows(from, n);
    wider.Y.block(to, p, n, 1) = rows.y.segment(from, n) - by_one.y.segment(from, n);
    wider.y.segment(to, n) = rows.y.segment(from, n);
    ++kept;
  }
  if (kept < kFewestInstants) {
    return std::nullopt;
  }
  wider.shorten(kept);
  wider.dY.setZero();
  wider.dy.setZero();
  identify::LeastSquares sums(static_cast<std::size_t>(p) + 1, fit.weights);
  sums.add(wider);
  const identify::LeastSquaresFit with = sums.solve();
  std::vector<bool> alone(static_cast<std::size_t>(p) + 1, false);
  alone.back() = true;
  const identify::LeastSquaresFit without = sums.solve(alone);
  const identify::ResidualSummary summary = summary_of(wider, with, fit.weights);
  EffortSmoothing out{
      .sharpening = with.estimate[p], .standard_error = summary.standard_error[p], .freedom = summary.freedom};
  for (Eigen::Index j = 0; j < p; ++j) {
    if (summary.standard_error[j] > 0.0) {
      out.moved = std::max(out.moved, std::abs(with.estimate[j] - without.estimate[j]) / summary.standard_error[j]);
    }
  }
  return out;
}

EffortLag effort_lag(LogSource& log, const Setting& s, const Fit& fit, double delay, std::size_t most_rows) {
  const Setting wide = as_logged(s);
  const double step = s.survey.median_step;
  const std::optional<TwoSharpenings> both = two_sharpenings(log, wide, most_rows, false);
  if (!both) {
    return EffortLag::either;
  }
  const auto& [rows, by_one] = *both;
  try {
    const identify::TimeShiftedRows shifted(rows, identify::TimeEffect::delay, delay - step, delay + step);
    identify::SeparableValues at;
    if (!shifted.evaluate(Eigen::VectorXd::Constant(1, delay), false, at)) {
      return EffortLag::either;
    }
    const auto n = static_cast<Eigen::Index>(rows.outputs), p = static_cast<Eigen::Index>(rows.parameters);
    Eigen::MatrixXd columns(shifted.response().size(), p + 1);
    for (std::size_t k = 0; k < shifted.instants().size(); ++k) {
      const auto from = static_cast<Eigen::Index>(shifted.instants()[k]) * n, to = static_cast<Eigen::Index>(k) * n;
      columns.block(to, 0, n, p) = rows.Y.middleRows(from, n);
      columns.block(to, p, n, 1) = rows.y.segment(from, n) - by_one.y.segment(from, n);
    }
    const Eigen::VectorXd nearer = squares_left(at.columns, shifted.response(), fit.weights) -
                                   squares_left(columns, shifted.response(), fit.weights);
    identify::BlockSums sums(1);
    for (const double each : nearer) {
      sums.add(Eigen::VectorXd::Constant(1, each));
    }
    const identify::LongRunCovariance seen = identify::long_run_covariance(sums);
    const double reach = core::student_quantile(1.0 - kRiskOfLag, std::max(seen.freedom, 1.0)) *
                         std::sqrt(std::max(seen.matrix(0, 0), 0.0));
    return nearer.sum() > reach ? EffortLag::filter : nearer.sum() < -reach ? EffortLag::delay : EffortLag::either;
  } catch (const InvalidArgument&) {
    return EffortLag::either;  // segments shorter than the delay
  }
}

}  // namespace wheelwright::commission

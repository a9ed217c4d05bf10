// SPDX-License-Identifier: Apache-2.0
#include "commission/choice/filter_criterion.hpp"

#include <algorithm>
#include <cmath>
#include <span>

#include <Eigen/Core>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "core/statistics.hpp"
#include "identify/estimate.hpp"
#include "identify/least_squares.hpp"
#include "identify/noise_level.hpp"
#include "model/filter/noise.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {
namespace {

constexpr double kCollinear = 1e-12;      // of a column's Σ Y²: what the columns before it leave
constexpr double kMostNoise = 0.9;        // of a direction of Σ YᵀY
constexpr double kExplainedTorque = 0.5;  // of the torque
constexpr std::size_t kFewestCompared = 50;
constexpr std::size_t kBuffer = 256;

// Rows of one filter on their way to take(rows).
class Rows {
 public:
  Rows(const Model& model, const FilterDesign& design, const Measurement& measurement)
      : filter_(model, design, measurement) {
    empty();
  }
  void restart() { filter_.restart(); }
  template <typename Take>
  void step(double t, std::span<const double> sample, Take take) {
    if (!filter_.step(t, sample)) {
      return;
    }
    const auto n = static_cast<Eigen::Index>(block_.outputs);
    const auto first = static_cast<Eigen::Index>(filled_) * n;
    block_.Y.middleRows(first, n) = filter_.row().Y;
    block_.y.segment(first, n) = filter_.row().y;
    block_.t[filled_] = t;
    block_.sample[filled_] = 0;
    if (++filled_ == kBuffer) {
      take(block_);
      filled_ = 0;
    }
  }
  template <typename Take>
  void flush(Take take) {
    if (filled_ > 0) {
      RegressionBlock rest;
      rest.resize(filled_, block_.outputs, block_.parameters);
      rest.t.assign(block_.t.begin(), block_.t.begin() + static_cast<std::ptrdiff_t>(filled_));
      rest.sample.assign(filled_, 0);
      rest.Y = block_.Y.topRows(rest.rows());
      rest.y = block_.y.head(rest.rows());
      rest.dY.setZero();
      rest.dy.setZero();
      take(rest);
    }
    empty();
  }

 private:
  void empty() {
    block_.resize(kBuffer, filter_.model().n(), filter_.model().p());
    block_.dY.setZero();
    block_.dy.setZero();
    filled_ = 0;
  }
  RegressorFilter filter_;
  RegressionBlock block_;
  std::size_t filled_ = 0;
};

// One walk: the rows of filter k are given to take(k, rows).
template <typename Take>
void walk(LogSource& log, const Model& model, const Measurement& measurement, const std::vector<FilterDesign>& designs,
          Take take) {
  std::vector<Rows> filters;
  for (const FilterDesign& design : designs) {
    filters.emplace_back(model, design, measurement);
  }
  core::for_each_sample(log, measurement.columns(), [&](const core::LogSample& sample) {
    for (std::size_t f = 0; f < filters.size(); ++f) {
      if (sample.starts) {
        filters[f].restart();
      }
      filters[f].step(sample.t, sample.values, [&](const RegressionBlock& rows) { take(f, rows); });
    }
  });
  for (std::size_t f = 0; f < filters.size(); ++f) {
    filters[f].flush([&](const RegressionBlock& rows) { take(f, rows); });
  }
}

double geometric_mean(const Eigen::VectorXd& values, const std::vector<bool>& counts) {
  double sum = 0.0, number = 0.0;
  for (Eigen::Index k = 0; k < values.size(); ++k) {
    if (counts[static_cast<std::size_t>(k)]) {
      sum += std::log(values[k]);
      number += 1.0;
    }
  }
  return number > 0.0 ? std::exp(sum / number) : core::kInfinity;
}

}  // namespace

struct FilterEvaluation::Fit {
  FilterDesign design;
  identify::RegressionMoments moments;
  Eigen::VectorXd weights;
  identify::Estimate estimate;
};

FilterEvaluation::FilterEvaluation(LogSource& log, const Model& model, const Measurement& measurement,
                                   FilterCriterion criterion, const FilterCriterionOptions& options)
    : log_(&log), model_(model), measurement_(measurement), criterion_(criterion), options_(options) {
  check::that(criterion != FilterCriterion::residual_over_torque, "criterion", "predicted_error or threshold_width");
  check::non_negative(options.motion_noise.value_or(0.0), "motion_noise");
  check::non_negative(options.bias_left, "bias_left");
  check::positive(options.step, "step");
  check::that(options.risk > 0.0 && options.risk < 1.0, "risk", "a number inside (0, 1)");
}

std::vector<FilterValue> FilterEvaluation::operator()(const std::vector<FilterDesign>& designs) {
  std::vector<Fit> fits = fit(designs);
  leave_out(fits);
  for (Fit& f : fits) {
    if (f.moments.instants() >= kFewestCompared) {
      f.weights = identify::efficient_weights(f.moments);
      f.estimate = identify::ordinary_least_squares(f.moments, {.weights = f.weights, .excluded = excluded_});
    }
  }
  if (criterion_ == FilterCriterion::threshold_width) {
    return threshold_widths(fits);
  }
  std::vector<FilterValue> values;
  for (const Fit& f : fits) {
    values.push_back(predicted_error(f));
  }
  return values;
}

std::vector<FilterEvaluation::Fit> FilterEvaluation::fit(const std::vector<FilterDesign>& designs) {
  std::vector<Fit> fits;
  for (const FilterDesign& design : designs) {
    fits.push_back({design, identify::RegressionMoments(model_.n(), model_.p()), {}, {}});
  }
  walk(*log_, model_, measurement_, designs,
       [&](std::size_t k, const RegressionBlock& rows) { fits[k].moments.add(rows); });
  ++walks_;
  return fits;
}

void FilterEvaluation::leave_out(const std::vector<Fit>& fits) {
  if (!excluded_.empty()) {
    return;
  }
  excluded_.assign(model_.p(), false);
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(model_.n()));
  for (const Fit& f : fits) {
    if (f.moments.instants() < kFewestCompared) {
      continue;
    }
    // Elimination column by column: the pivot is what the columns before leave.
    Eigen::MatrixXd G = f.moments.total(ones).YY;
    const Eigen::VectorXd size = G.diagonal();
    for (Eigen::Index j = 0; j < G.cols(); ++j) {
      const auto at = static_cast<std::size_t>(j);
      if (excluded_[at] || !(G(j, j) > kCollinear * size[j])) {
        excluded_[at] = true;
        continue;
      }
      const Eigen::VectorXd column = G.col(j);
      G -= column * column.transpose() / column[j];
    }
  }
}

FilterValue FilterEvaluation::predicted_error(const Fit& f) const {
  FilterValue value{core::kInfinity, Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model_.p()))};
  if (!f.estimate.usable) {
    return value;
  }
  Eigen::VectorXd bias = Eigen::VectorXd::Zero(value.parts.size());
  if (options_.motion_noise.value_or(0.0) > 0.0 && options_.bias_left > 0.0) {
    std::vector<Eigen::Index> kept;
    for (std::size_t j = 0; j < excluded_.size(); ++j) {
      if (!excluded_[j]) {
        kept.push_back(static_cast<Eigen::Index>(j));
      }
    }
    const filter::NoiseGram gram = filter::noise_gram(model_, f.design, measurement_, options_.step);
    Eigen::MatrixXd added = Eigen::MatrixXd::Zero(value.parts.size(), value.parts.size());
    for (std::size_t i = 0; i < gram.motion.size(); ++i) {
      added += std::pow(f.weights[static_cast<Eigen::Index>(i)], 2.0) * gram.motion[i];
    }
    added *= static_cast<double>(f.moments.instants()) * std::pow(*options_.motion_noise, 2.0);
    const Eigen::MatrixXd G = f.moments.total(f.weights).YY;
    const Eigen::VectorXd scale = G.diagonal()(kept).cwiseSqrt().cwiseInverse();
    const Eigen::MatrixXd all = scale.asDiagonal() * G(kept, kept) * scale.asDiagonal();
    const Eigen::MatrixXd noise = scale.asDiagonal() * added(kept, kept) * scale.asDiagonal();
    const std::optional<Eigen::VectorXd> share = core::generalized_eigenvalues(noise, all);
    if (!(share && share->maxCoeff() < kMostNoise)) {
      return value;
    }
    const Eigen::VectorXd theta = scale.cwiseInverse().asDiagonal() * f.estimate.theta(kept);
    bias(kept) = -options_.bias_left *
                 (scale.asDiagonal() * core::LdltFactors(all - noise).solve(Eigen::VectorXd(noise * theta)));
  }
  value.parts = (f.estimate.standard_error.array().square() + bias.array().square()).sqrt();
  std::vector<bool> counts = excluded_;
  counts.flip();
  value.criterion = geometric_mean(value.parts, counts);
  return value;
}

std::vector<FilterValue> FilterEvaluation::threshold_widths(const std::vector<Fit>& fits) {
  const auto n = static_cast<Eigen::Index>(model_.n());
  std::vector<FilterDesign> designs;
  std::vector<identify::ResidualStatistics> statistics;
  for (const Fit& f : fits) {
    designs.push_back(f.design);
    const bool usable = f.estimate.usable;
    statistics.emplace_back(
        usable ? f.estimate.theta : Eigen::VectorXd(Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model_.p()))),
        usable ? f.weights : Eigen::VectorXd(Eigen::VectorXd::Ones(n)));
  }
  walk(*log_, model_, measurement_, designs,
       [&](std::size_t k, const RegressionBlock& rows) { statistics[k].add(rows); });
  ++walks_;
  std::vector<FilterValue> values;
  std::vector<bool> explained(model_.n(), false);
  for (std::size_t k = 0; k < fits.size(); ++k) {
    values.push_back({core::kInfinity, Eigen::VectorXd::Constant(n, core::kInfinity)});
    const Fit& f = fits[k];
    if (!f.estimate.usable) {
      continue;
    }
    const identify::ResidualSummary summary =
        statistics[k].summary(Eigen::MatrixXd::Zero(f.estimate.theta.size(), f.estimate.theta.size()));
    const double t = core::student_quantile(1.0 - options_.risk, f.estimate.freedom);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const identify::OutputResidual& rest = summary.outputs[at];
      if (!(rest.torque_rms > 0.0)) {
        continue;
      }
      const double bound = identify::extrapolate(rest, summary.instants, {.risk = options_.risk}).bound;
      const double spread = (f.estimate.covariance * f.moments.of_output(at).YY).trace();
      const double of_theta = std::sqrt(std::max(spread, 0.0) / static_cast<double>(summary.instants));
      values[k].parts[i] = 2.0 * (bound + t * of_theta) / rest.torque_rms;
      explained[at] = explained[at] || rest.rms < kExplainedTorque * rest.torque_rms;
    }
  }
  if (explained_.empty()) {
    const bool any = std::ranges::any_of(explained, [](bool e) { return e; });
    explained_ = any ? explained : std::vector<bool>(model_.n(), true);
  }
  for (FilterValue& value : values) {
    value.criterion = geometric_mean(value.parts, explained_);
  }
  return values;
}

}  // namespace wheelwright::commission

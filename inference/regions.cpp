// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/regions.hpp>

#include <limits>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/statistics.hpp>
#include <wheelwright/identify/noise_level.hpp>

namespace wheelwright {
namespace {

constexpr double kLargeEdges = 0.1;  // of the variance of a sum: a doubt worth a remark

RegionRow nothing(RegionMethod method, double confidence, std::size_t p) {
  RegionRow row;
  row.method = method;
  row.confidence = confidence;
  row.lower = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(p), -std::numeric_limits<double>::infinity());
  row.upper = -row.lower;
  return row;
}

RegionRow student_row(const Estimate& estimate, double confidence, std::size_t p) {
  RegionRow row = nothing(RegionMethod::student_t, confidence, p);
  row.promise = fmt::format(
      "{:.4g} % of such logs for each parameter, in the long run, while the errors' mean does not depend on the motion "
      "and their memory is short against the log",
      100.0 * confidence);
  row.available = estimate.usable;
  row.remark = estimate.reason;
  if (row.available) {
    const double t = student_quantile(confidence, estimate.freedom);
    row.lower = estimate.theta - t * estimate.standard_error;
    row.upper = estimate.theta + t * estimate.standard_error;
  }
  return row;
}

RegionRow bootstrap_row(const BlockBootstrap& bootstrap, std::size_t p) {
  RegionRow row = nothing(RegionMethod::block_bootstrap, bootstrap.confidence, p);
  row.promise = fmt::format(
      "{:.4g} % of such logs for each parameter, in the long run, while the log is stationary and errors further apart "
      "than {:.2g} s are independent; errors may be skewed",
      100.0 * bootstrap.confidence, bootstrap.seconds);
  row.available = bootstrap.usable;
  row.remark = bootstrap.reason;
  if (row.available) {
    row.lower = bootstrap.lower;
    row.upper = bootstrap.upper;
  }
  return row;
}

RegionRow sign_row(const SignPerturbedSums& sums, std::size_t p) {
  RegionRow row = nothing(RegionMethod::sign_perturbed_sums, sums.probability(), p);
  row.all_at_once = true;
  row.promise = fmt::format(
      "at least {:.4g} % for all parameters at once, for a log of any length, if errors in different stretches of "
      "{:.2g} s "
      "are independent and as likely of either sign",
      100.0 * sums.probability(), sums.group_seconds());
  row.available = sums.usable();
  row.remark = sums.reason();
  if (row.available) {
    const SignPerturbedBounds bounds = sums.bounds();
    row.lower = bounds.lower;
    row.upper = bounds.upper;
    if (sums.edge_share() > kLargeEdges) {
      row.remark = fmt::format(
          "the log is short for its errors' memory: {} stretches are still correlated and miss "
          "about {:.0f} % of the variance",
          sums.groups(), 100.0 * sums.edge_share());
    } else if (!row.lower.allFinite() || !row.upper.allFinite()) {
      row.remark = fmt::format("{} stretches are too few to bound every parameter", sums.groups());
    }
  }
  return row;
}

RegionRow hull_row(const IntervalBounds& hull) {
  RegionRow row;
  row.method = RegionMethod::interval_hull;
  row.available = row.all_at_once = true;
  row.confidence = 1.0;
  row.lower = hull.lower;
  row.upper = hull.upper;
  row.promise = fmt::format("always, for all parameters at once, while |e| ≤ {:.3g}{}{} at every instant",
                            fmt::join(hull.error, " and "), hull.unit.empty() ? "" : " ", hull.unit);
  return row;
}

}  // namespace

std::string_view to_string(RegionMethod method) {
  switch (method) {
    case RegionMethod::student_t: return "student_t";
    case RegionMethod::block_bootstrap: return "block_bootstrap";
    case RegionMethod::sign_perturbed_sums: return "sign_perturbed_sums";
    case RegionMethod::interval_hull: return "interval_hull";
  }
  return {};
}

RegionComparison compare_regions(const RegressionMoments& moments, const Estimate& estimate,
                                 const RegionOptions& options, const std::optional<IntervalBounds>& hull) {
  const std::size_t p = moments.parameters();
  check::that(static_cast<std::size_t>(estimate.theta.size()) == p, "estimate", "one of these moments");
  const bool instruments = estimate.estimator == Estimator::instrumental_variables;
  BlockBootstrapOptions bootstrap_options = options.bootstrap;
  bootstrap_options.confidence = options.confidence;
  bootstrap_options.instruments = instruments;
  SignPerturbedOptions sign_options = options.sign_perturbed;
  sign_options.confidence = options.confidence;
  sign_options.instruments = instruments;
  const BlockBootstrap bootstrap = block_bootstrap(moments, bootstrap_options);
  const SignPerturbedSums sums(moments, sign_options);

  RegionComparison comparison;
  comparison.theta = estimate.theta;
  comparison.rows = {student_row(estimate, options.confidence, p), bootstrap_row(bootstrap, p), sign_row(sums, p)};
  comparison.bootstrap_seconds = bootstrap.seconds;
  comparison.sign_seconds = sums.group_seconds();
  comparison.sign_groups = sums.groups();
  if (!instruments && estimate.estimator != Estimator::least_squares) {
    for (std::size_t i : {std::size_t{1}, std::size_t{2}}) {
      std::string& remark = comparison.rows[i].remark;
      remark += remark.empty() ? "" : "; ";
      remark += "of least squares, which noise of the motion biases";
    }
  }
  if (hull) {
    check::that(static_cast<std::size_t>(hull->lower.size()) == p && hull->upper.size() == hull->lower.size(),
                "interval hull", "an interval for each parameter");
    comparison.rows.push_back(hull_row(*hull));
  }
  return comparison;
}

}  // namespace wheelwright

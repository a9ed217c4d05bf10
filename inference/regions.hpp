// SPDX-License-Identifier: Apache-2.0
/// \file
/// Intervals for the parameters of one log by every method there is, side by side, each with what it promises.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/identify/estimate.hpp>
#include <wheelwright/inference/block_bootstrap.hpp>
#include <wheelwright/inference/sign_perturbed_sums.hpp>

namespace wheelwright {

/// How a row of the comparison was found.
enum class RegionMethod { student_t, block_bootstrap, sign_perturbed_sums, interval_hull };

/// Name for people and files: "student_t", …
[[nodiscard]] std::string_view to_string(RegionMethod method);

/// Intervals by one method.
struct RegionRow {
  RegionMethod method = RegionMethod::student_t;
  bool available = false;    ///< if not, `remark` says why
  bool all_at_once = false;  ///< the promise is for all parameters together, not for each of them
  double confidence = 0.0;   ///< of the promise; 1 for the interval hull
  Eigen::VectorXd lower;     ///< p; ±∞ where there is no bound
  Eigen::VectorXd upper;     ///< p
  std::string promise;       ///< one line: how often, and under which assumption
  std::string remark;        ///< why it is not available, or a doubt; may be empty
};

/// The interval hull, by the caller (bounds/).
struct IntervalBounds {
  Eigen::VectorXd lower;  ///< p
  Eigen::VectorXd upper;  ///< p
  Eigen::VectorXd error;  ///< ē of each output
  std::string unit;       ///< of ē, may be empty
};

/// What is compared.
struct RegionOptions {
  double confidence = 0.95;
  BlockBootstrapOptions bootstrap;      ///< `confidence` and `instruments` are set by the comparison
  SignPerturbedOptions sign_perturbed;  ///< the same
};

/// One row for each method.
struct RegionComparison {
  Eigen::VectorXd theta;           ///< p, of the estimate
  std::vector<RegionRow> rows;     ///< Student's t, bootstrap, sign-perturbed sums, and the hull where it was given
  double bootstrap_seconds = 0.0;  ///< length of a stretch
  double sign_seconds = 0.0;       ///< length of a group with one sign
  std::size_t sign_groups = 0;
};

/// Compares on the moments of one log. Bootstrap and sign-perturbed sums take instruments when `estimate` is one of
/// instrumental variables; they have no form for the two estimators that take noise out of Σ YᵀY, are made for least
/// squares there, and the remark says so.
[[nodiscard]] RegionComparison compare_regions(const RegressionMoments& moments, const Estimate& estimate,
                                               const RegionOptions& options = {},
                                               const std::optional<IntervalBounds>& hull = std::nullopt);

}  // namespace wheelwright

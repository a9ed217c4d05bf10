// SPDX-License-Identifier: Apache-2.0
/// \file
/// First pass over a regression: a spread sample of its rows, consistency checks, scales and coupling of the
/// parameters.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "bounds/box.hpp"
#include "bounds/interval_hull.hpp"
#include "core/regression.hpp"

namespace wheelwright::bounds {

/// Up to 16 384 rows, or all where there are fewer, in runs of eight (a line of the cache) at even distances.
class SpreadSample {
 public:
  /// Copies the sample.
  explicit SpreadSample(const SlabColumns& rows);
  /// Σ YᵀY / w² over the sample, w the half-width of a row over the prior box (p × p).
  [[nodiscard]] Eigen::MatrixXd information(const Box& prior) const;
  /// Least squares on the sample with the same weights, drawn to the middle of the box by its half-widths;
  /// `information` is information(prior).
  [[nodiscard]] Eigen::VectorXd estimate(const Box& prior, const Eigen::MatrixXd& information) const;
  /// Calls `take` with 1/16, 1/4 and then all of the sample; false as soon as `take` says so.
  bool each_level(const std::function<bool(const SlabColumns&)>& take) const;
  /// All of the sample.
  [[nodiscard]] const SlabColumns& all() const { return levels_.back(); }

 private:
  [[nodiscard]] Eigen::VectorXd weights(const Box& prior) const;

  std::unique_ptr<double[]> memory_;
  std::vector<std::size_t> samples_;
  std::vector<double> times_;
  std::vector<SlabColumns> levels_;
};

/// Result of one pass over all rows.
struct RowSurvey {
  std::size_t instants = 0;                      ///< instants seen (excluded ones not counted)
  std::size_t rows = 0;                          ///< rows seen: outputs × instants
  std::vector<std::vector<std::size_t>> blocks;  ///< groups of parameters that no row couples; see independent_blocks()
  std::vector<bool> noisy;                       ///< per parameter: some dY of its column is not 0
  Eigen::MatrixXd information;  ///< p × p: Σ YᵀY / w², w the half-width of the row over the prior box
  Eigen::VectorXd moment;       ///< p: Σ Yᵀ y / w²
  RegressionBlock sample;       ///< at most 1024 instants, evenly spread
};

/// Walks `source` once. Instants whose number is in `excluded` (ascending) are skipped. A row of half-width 0 (no error
/// bounds) gets the weight of a half-width 1e-9 of its reach over the prior box. Throws InvalidArgument when shapes
/// disagree, a number is not finite, or a bound is negative.
[[nodiscard]] RowSurvey survey(core::RegressionSource& source, const Box& prior,
                               const std::vector<std::size_t>& excluded = {});

/// Parameters whose column is noisy and whose sign the box leaves open.
[[nodiscard]] std::vector<std::size_t> open_signs(const RowSurvey& survey, const Box& box);

/// Least squares with the weights of the survey, drawn to the middle of the box by the weight of its half-widths (so
/// that it exists for any rank). Uncertified; it need not lie in the box.
[[nodiscard]] Eigen::VectorXd weighted_estimate(const RowSurvey& survey, const Box& prior);

}  // namespace wheelwright::bounds

// SPDX-License-Identifier: Apache-2.0
/// \file
/// An evenly spread sample of rows in memory, in levels: each level as many again as all before.
#pragma once

#include <functional>
#include <vector>

#include <wheelwright/bounds/box.hpp>
#include <wheelwright/bounds/slab_columns.hpp>

namespace wheelwright {

/// Up to 16 384 rows, or all where there are fewer, in runs of eight (a line of the cache) at even distances.
class SpreadSample {
 public:
  /// Copies the sample.
  explicit SpreadSample(const SlabColumns& rows);
  /// Σ YᵀY / w² over the sample, w the half-width of a row over the prior box (p × p).
  [[nodiscard]] Eigen::MatrixXd information(const Box& prior) const;
  /// Least squares on the sample with the same weights, drawn to the middle of the box by its half-widths.
  [[nodiscard]] Eigen::VectorXd estimate(const Box& prior) const;
  /// Calls `take` with 1/16, 1/4 and then all of the sample; false as soon as `take` says so.
  bool each_level(const std::function<bool(const SlabColumns&)>& take) const;
  /// All of the sample.
  [[nodiscard]] const SlabColumns& all() const { return levels_.back(); }

 private:
  [[nodiscard]] Eigen::VectorXd weights(const Box& prior) const;

  std::vector<double> memory_;
  std::vector<std::size_t> samples_;
  std::vector<double> times_;
  std::vector<SlabColumns> levels_;
};

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Whether sums of errors spread wider, time and again, than errors of the assumed class can make them.
#pragma once

#include <cstddef>
#include <utility>

#include <Eigen/Core>

#include "detector/multiscale/scale_detector.hpp"

namespace wheelwright::commission {

/// Mean squares of a sum's S. For errors as assumed E √(V0/(V + V0)) exp(S²/(2(V + V0))) <= 1 in each window, given
/// what was before, so that over windows that are apart Σ (S²/(V + V0) − ln(1 + V/V0)) exceeds 2L with the probability
/// e^−L at most; so does the mean of that over groups of such windows (Jensen's inequality), here all looks. What bias,
/// what counts at its worst and the set may add is taken away from S first. Windows count as apart after eight scales,
/// when 1 % of a sum is left.
class SumSpread {
 public:
  /// V0 of every sum (weights × scales), looks at a sum in the time of its scale, and the probability that errors as
  /// assumed fail.
  SumSpread(Eigen::MatrixXd usual, double checks, double risk);

  /// `variances`: V of every sum at that look.
  void add(const detector::SumState& look, const Eigen::MatrixXd& variances);

  /// Largest sum, in units of its limit, and its scale.
  [[nodiscard]] std::pair<double, std::size_t> largest() const;

 private:
  Eigen::MatrixXd usual_;
  double limit_;
  Eigen::MatrixXd sum_;
};

}  // namespace wheelwright::commission

// SPDX-License-Identifier: Apache-2.0
/// \file
/// One linear constraint on the parameters, and where it comes from.
#pragma once

#include <cstddef>

#include <Eigen/Core>

namespace wheelwright {

/// Which of the two inequalities of a slab, or of a side of the prior box, a half-space is.
enum class Side {
  upper,  ///< Yθ <= y + dy, or θ_j <= upper
  lower,  ///< Yθ >= y − dy, or θ_j >= lower
};

/// Where a half-space comes from: one row of the regression, or one side of the prior box.
struct RowOrigin {
  bool is_prior = false;      ///< a side of the prior box; `parameter` says which
  std::size_t parameter = 0;  ///< parameter of a side of the prior box
  std::size_t sample = 0;     ///< row number in the log (RegressionBlock::sample)
  double t = 0.0;             ///< time of that row, s
  std::size_t output = 0;     ///< output (channel) of the row
  Side side = Side::upper;    ///< which inequality
  friend bool operator==(const RowOrigin&, const RowOrigin&) = default;
};

/// { θ : a·θ <= b }.
struct HalfSpace {
  Eigen::VectorXd a;  ///< p coefficients
  double b = 0.0;     ///< right-hand side, unit of the output
  RowOrigin origin;   ///< where it comes from
};

/// A half-space and its multiplier in a linear combination of constraints.
struct WeightedRow {
  HalfSpace row;            ///< the constraint a·θ <= b
  double multiplier = 0.0;  ///< λ >= 0
};

}  // namespace wheelwright

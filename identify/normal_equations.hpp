// SPDX-License-Identifier: Apache-2.0
/// \file
/// Least squares at the speed of reading: normal equations, and one step of refinement that gives back the digits they cost.
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include <wheelwright/core/regression.hpp>

namespace wheelwright {

/// Solution of min Σ w_i² (y − Yθ)² by normal equations.
struct NormalEquationsFit {
  /// How it went.
  enum class Status {
    refined,         ///< solved and refined
    ill_conditioned  ///< columns of unit length have a condition number above 10⁶: use LeastSquares; no estimate
  };
  Status status = Status::ill_conditioned;
  Eigen::VectorXd estimate;  ///< p
  double correction = 0.0;   ///< largest relative change that the refinement made: what the first solve lacked
  double condition = 0.0;    ///< of the columns at unit length
  double weighted_rss = 0.0;
  std::size_t instants = 0;
};

/// Two walks over the rows: G = Σ w²YᵀY and g = Σ w²Yᵀy, θ by Cholesky in unit columns; then θ += G⁻¹ Σ w²Yᵀ(y − Yθ)
/// (Björck 1996: normal equations with fixed-precision refinement lose the square of the condition number once,
/// and gain it back at each step while κ² ε < 1). `weights` has one for each output; empty: all one. Throws
/// InvalidArgument for rows without instants or weights of another number.
[[nodiscard]] NormalEquationsFit normal_equations(RegressionSource& rows, const Eigen::VectorXd& weights = {});
/// The same for rows in memory.
[[nodiscard]] NormalEquationsFit normal_equations(const RegressionBlock& rows, const Eigen::VectorXd& weights = {});

}  // namespace wheelwright

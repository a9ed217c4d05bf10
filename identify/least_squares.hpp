// SPDX-License-Identifier: Apache-2.0
/// \file
/// Least squares on filtered torque by sequential QR: θ̂_L of (30) without ever holding the rows.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/core/regression.hpp>

namespace wheelwright {

/// Solution of min Σ w_i² (y − Yθ)².
struct LeastSquaresFit {
  Eigen::VectorXd estimate;      ///< p; along directions that the data do not determine, the part of least norm in
                                 ///< scaled columns
  Eigen::VectorXd column_rms;    ///< p, root mean square of each weighted column (per instant)
  Eigen::VectorXd partial_rms;   ///< p, the same after the part that the other columns explain is taken away: what
                                 ///< the data say about θ_j alone
  Eigen::MatrixXd inverse_gram;  ///< p × p, (Σ w² YᵀY)⁻¹ (pseudo-inverse where the rank is deficient)
  int rank = 0;                  ///< numerical rank with columns scaled to unit length
  double condition = 0.0;        ///< ratio of the largest to the smallest singular value of the scaled columns
  double weighted_rss = 0.0;     ///< Σ w_i² (y − Yθ̂)²
  double weighted_tss = 0.0;     ///< Σ w_i² y²
  std::size_t instants = 0;      ///< number of instants
};

/// Ordinary least squares, or weighted with one weight for each output. Rows are folded into a (p+1) × (p+1)
/// triangular factor by Householder reflections (Golub and Van Loan 2013, section 5.2), so that the condition number
/// enters once, not squared.
class LeastSquares {
 public:
  /// `weights`: w_i > 0 for each output; one over its residual's standard deviation is efficient. Empty: all one.
  explicit LeastSquares(std::size_t parameters, Eigen::VectorXd weights = {});
  /// Adds instants [first, last) of `block` (all by default).
  void add(const RegressionBlock& block, std::size_t first = 0, std::size_t last = static_cast<std::size_t>(-1));
  /// Adds all that `other` has seen; it must have the same parameters and weights.
  void merge(const LeastSquares& other);
  /// Number of instants added.
  [[nodiscard]] std::size_t instants() const { return instants_; }
  /// The triangular factor of [Y y] with weighted rows: (p+1) × (p+1), upper triangular; ‖[Y y]v‖ = ‖factor()·v‖ for
  /// every v.
  [[nodiscard]] Eigen::MatrixXd factor() const;
  /// The fit to what was added, with θ_j = 0 where `excluded[j]` (empty: none). Throws InvalidArgument when nothing was
  /// added.
  [[nodiscard]] LeastSquaresFit solve(const std::vector<bool>& excluded = {}) const;

 private:
  void fold() const;

  std::size_t p_;
  Eigen::VectorXd weights_;
  std::size_t instants_ = 0;
  mutable Eigen::MatrixXd stack_;  // triangular factor on top, rows waiting to be folded below
  mutable Eigen::Index filled_;
};

/// The fit to all of `rows`, one pass.
[[nodiscard]] LeastSquaresFit least_squares(RegressionSource& rows, const Eigen::VectorXd& weights = {});

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Robust losses, and their minimum over rows in memory, by Ceres.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/core/regression.hpp>
#include <wheelwright/inference/constrained.hpp>

namespace wheelwright::inference {

/// A loss ρ(u), even, with ρ(u) ≈ u²/2 near 0 (Huber 1981; Maronna, Martin and Yohai 2006, chapter 2).
enum class Loss {
  squared,  ///< u²/2: least squares
  huber,    ///< u²/2 up to |u| = c, then c|u| − c²/2: convex, the influence of a row is bounded
  cauchy,   ///< c²/2·ln(1 + u²/c²): the influence of a row falls as 1/|u|; not convex
  tukey,    ///< c²/6·(1 − (1 − u²/c²)³), and c²/6 beyond |u| = c: rows beyond c count nothing; not convex
};

/// The constant c with which a location or regression estimate keeps 95 % of the efficiency of least squares under
/// Gaussian residuals: 1.345 (huber), 2.385 (cauchy), 4.685 (tukey; Holland and Welsch 1977). 1 for squared, which has
/// none.
[[nodiscard]] double tuning_constant(Loss loss);

/// A loss with its constant c > 0.
struct LossFunction {
  Loss loss = Loss::huber;
  double c = 1.345;

  /// ρ(u) >= 0.
  [[nodiscard]] double rho(double u) const;
  /// ψ = ρ'.
  [[nodiscard]] double psi(double u) const;
  /// ψ', the limit from the side of 0 where it jumps.
  [[nodiscard]] double psi_slope(double u) const;
  /// ψ(u)/u in [0, 1], 1 at u = 0: the weight of the row in an equivalent least-squares fit.
  [[nodiscard]] double weight(double u) const;
  /// |u| beyond which the weight is below 1/2; infinite for squared.
  [[nodiscard]] double half_weight() const;
  /// sgn(u)·√(2ρ(u)), free of cancellation, and its derivative: least squares on it is the robust fit.
  struct Root {
    double value = 0.0;
    double slope = 1.0;
  };
  [[nodiscard]] Root root(double u) const;
};

/// Where Ceres stopped.
struct MEstimate {
  Eigen::VectorXd theta;   ///< p
  bool converged = false;  ///< Ceres's gradient, step or cost tolerance was met
  std::string message;     ///< Ceres's words
};

/// A local minimum of Σ ρ((y − Yθ)/s) near `start`, s one scale > 0 for each output, in at most 200 iterations of
/// Levenberg and Marquardt's method on the roots of the losses (LossFunction::root), in coordinates in which the rows
/// are orthonormal. Directions that the rows do not determine stay as they are in `start`.
[[nodiscard]] MEstimate m_estimate(const RegressionBlock& rows, const Eigen::VectorXd& scales, const LossFunction& loss,
                                   const Eigen::VectorXd& start);

/// Invertible B such that every constraint bounds one entry of z = Bθ: lower <= z <= upper, entries infinite where
/// nothing bounds them.
struct BoxCoordinates {
  Eigen::MatrixXd B;
  Eigen::VectorXd lower, upper;
};

/// True if `constraints` on p unknowns are a box in other coordinates: `box` is filled where they are (rows parallel to
/// each other apart, they are independent, and every interval has an inside).
[[nodiscard]] bool find_box(const std::vector<LinearConstraint>& constraints, Eigen::Index p, BoxCoordinates& box);

/// The same with the bounds of `box`; `start` is moved into them.
[[nodiscard]] MEstimate m_estimate(const RegressionBlock& rows, const Eigen::VectorXd& scales, const LossFunction& loss,
                                   const Eigen::VectorXd& start, const BoxCoordinates& box);

}  // namespace wheelwright::inference

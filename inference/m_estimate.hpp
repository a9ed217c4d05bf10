// SPDX-License-Identifier: Apache-2.0
/// \file
/// Minimum of a robust loss over rows in memory, by Ceres.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/core/regression.hpp>
#include <wheelwright/inference/constrained.hpp>
#include <wheelwright/inference/loss.hpp>

namespace wheelwright {

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

/// Whether `constraints` on p unknowns are a box in other coordinates: `box` is filled where they are (rows parallel to
/// each other apart, they are independent, and every interval has an inside).
[[nodiscard]] bool find_box(const std::vector<LinearConstraint>& constraints, Eigen::Index p, BoxCoordinates& box);

/// The same with the bounds of `box`; `start` is moved into them.
[[nodiscard]] MEstimate m_estimate(const RegressionBlock& rows, const Eigen::VectorXd& scales, const LossFunction& loss,
                                   const Eigen::VectorXd& start, const BoxCoordinates& box);

}  // namespace wheelwright

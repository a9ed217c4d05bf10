// SPDX-License-Identifier: Apache-2.0
/// \file
/// Small least squares from normal equations, some coefficients of a given sign.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace wheelwright::gap {

/// The minimiser of ½ xᵀA x − bᵀx.
struct SignedSolution {
  Eigen::VectorXd x;
  std::vector<bool> zero;  ///< held at 0: by its sign, or since A does not determine it
};

/// argmin ½ xᵀA x − bᵀx over sign_i x_i >= 0 (sign 0: free; `sign` may be empty), A symmetric positive semidefinite, by
/// active sets (Lawson and Hanson 1974, chapter 23). Unknowns that A determines to fewer than ten digits, given those
/// before them, are held at 0.
[[nodiscard]] SignedSolution signed_least_squares(const Eigen::MatrixXd& A, const Eigen::VectorXd& b,
                                                  const std::vector<int>& sign);

/// (A restricted to the unknowns that are not `zero`)⁻¹ in its place, zeros elsewhere.
[[nodiscard]] Eigen::MatrixXd restricted_inverse(const Eigen::MatrixXd& A, const std::vector<bool>& zero);

}  // namespace wheelwright::gap

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Inverses in floating point with a bound of their error.
#pragma once

#include <Eigen/Core>

namespace wheelwright {

/// W ≈ L⁻¹ and how far W L is from the identity.
struct ApproximateInverse {
  Eigen::MatrixXd inverse;  ///< W, q × q
  double defect = 0.0;      ///< |I − W L| <= defect (Euclidean), proved; infinite where W is of no use
};

/// The inverse of a square matrix, its defect enclosed in outward arithmetic. Where the defect is below one, L is
/// regular, and u = L⁻¹v has |W v|/(1 + defect) <= |u| <= |W v|/(1 − defect).
[[nodiscard]] ApproximateInverse approximate_inverse(const Eigen::MatrixXd& matrix);

}  // namespace wheelwright

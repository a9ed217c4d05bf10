// SPDX-License-Identifier: Apache-2.0
/// \file
/// Coordinates in which a set of parameters is round and of size one, whatever the units of the parameters.
#pragma once

#include <Eigen/Core>

#include <wheelwright/bounds/box.hpp>

namespace wheelwright {

/// Affine coordinates z of parameters in which a set has a size of about one: θ = centre + transform z.
struct Coordinates {
  Eigen::VectorXd centre;     ///< θ at z = 0
  Eigen::MatrixXd transform;  ///< p × p, regular
};

/// Coordinates about the centre of `box` with Tᵀ (information + D⁻²) T ≈ 1, D the half-widths of the box: whitened
/// where `information` (p × p, symmetric, positive semi-definite, units 1/θ²) says something, as wide as the box
/// elsewhere.
[[nodiscard]] Coordinates whitened(const Box& box, const Eigen::MatrixXd& information);

/// Half-widths of a box about the origin of z that contains `box` (to rounding).
[[nodiscard]] Eigen::VectorXd extent(const Box& box, const Coordinates& coordinates);

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The smallest ellipsoid around points.
#pragma once

#include <optional>

#include <wheelwright/bounds/coordinates.hpp>
#include <wheelwright/bounds/vertices.hpp>

namespace wheelwright {

/// { centre + shape u : |u| <= 1 }.
struct VertexEllipsoid {
  Eigen::VectorXd centre;  ///< q entries
  Eigen::MatrixXd shape;   ///< q × q
};

/// The ellipsoid of least volume around the exact vertices (Löwner's; John 1948), which are within the radius of the
/// points: its weights are a D-optimal design of experiments (Titterington 1975), found by exact maximisation over one
/// weight at a time on the few points that matter; stops where no point lies outside by more than `tolerance`
/// (relative), or after `cycles` cycles over them. Then it is scaled until every vertex is proved to lie inside.
///
/// The points have size about one in `coordinates`. Nothing where they are too flat for doubles.
[[nodiscard]] std::optional<VertexEllipsoid> vertex_ellipsoid(const VertexSet& vertices, const Coordinates& coordinates,
                                                              double tolerance, std::size_t cycles);

}  // namespace wheelwright

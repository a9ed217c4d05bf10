// SPDX-License-Identifier: Apache-2.0
/// \file
/// All vertices of a polytope, proved complete.
#pragma once

#include <optional>
#include <span>

#include <wheelwright/bounds/infeasibility.hpp>

namespace wheelwright {

/// Vertices of a polytope P' that contains P and exceeds it by about `looseness` of P's size.
struct VertexSet {
  Eigen::MatrixXd points;  ///< p × V, one vertex per column
  Eigen::VectorXd radius;  ///< p: each point is within radius_j of an exact vertex of P' in coordinate j
  double looseness = 0.0;  ///< outward shift of the facets, relative to the size of P in `coordinates`
};

/// Enumerates the vertices of P = { θ : a·θ <= b for every row }, bounded and with an interior, at most `limit` of
/// them.
///
/// Facets are shifted outward by a tiny pseudo-random amount, so that exactly p of them meet in each vertex, and are
/// inserted one by one: the vertices that a facet cuts off are replaced by one on every edge that it crosses (Motzkin
/// et al. 1953, in its simple-polytope form). Then the result is proved: every vertex is enclosed (|θ − θ*| <= radius,
/// from an approximate inverse), strictly inside all other facets, and each of its p edges ends in another vertex of
/// the list. The graph of a polytope is connected (Balinski 1961), so a list that is closed under adjacency is complete
/// and P ⊆ P' = conv of the exact vertices.
///
/// Nothing where the limit is passed or no shift up to 1e-6 passes the proof (a set that is too flat for doubles).
/// `coordinates` are such that P has size about one.
[[nodiscard]] std::optional<VertexSet> enumerate_vertices(std::span<const HalfSpace> rows,
                                                          const Coordinates& coordinates, std::size_t limit);

}  // namespace wheelwright

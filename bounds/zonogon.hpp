// SPDX-License-Identifier: Apache-2.0
/// \file
/// Zonotopes in the plane.
#pragma once

#include <cstddef>
#include <optional>

#include <wheelwright/bounds/ellipsoid.hpp>
#include <wheelwright/bounds/zonotope.hpp>

namespace wheelwright {

/// A zonotope of at most `limit` >= 2 generators around a block of two parameters whose vertices are known; nothing for
/// other blocks, and where the block is too flat for doubles.
///
/// In the plane every centrally symmetric polygon is a zonotope, its generators half its edges. So the smallest one
/// with a given centre c is conv(P ∪ (2c − P)), and its perimeter is convex in c: it is minimised by a compass search,
/// in the coordinates that make the ellipse `round` (which contains the block) a circle. Beyond the limit, the
/// generator whose replacement by its two neighbours in angle adds least to the perimeter goes first. Then inclusion is
/// proved: the facets of a zonogon have the normals (−g_y, g_x) of its generators g, which are doubles, so it contains
/// the block where the certified supports of the polytope in these few directions say so; it is scaled until they do.
[[nodiscard]] std::optional<Zonotope::Block> outer_zonogon(const Polytope& polytope, const Polytope::Block& block,
                                                           const Ellipsoid::Block& round, std::size_t limit);

}  // namespace wheelwright

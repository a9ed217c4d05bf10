// SPDX-License-Identifier: Apache-2.0
/// \file
/// The slabs between which a polytope lies: what outer ellipsoids and zonotopes are made of.
#pragma once

#include <vector>

#include <Eigen/Core>

#include <wheelwright/bounds/polytope.hpp>

namespace wheelwright {

/// { θ : |a·θ − middle| <= half }.
struct FacetSlab {
  Eigen::VectorXd a;    ///< coefficients
  double middle = 0.0;  ///< unit of a·θ
  double half = 0.0;    ///< > 0, unit of a·θ
};

/// Slabs that contain a block of the polytope, in the block's parameters: one per facet (b above, the certified support
/// of −a below; facets that face each other share one) and one per side of the hull.
///
/// Slabs that are thinner than `resolution` units in the last place of a·θ are widened to that: thinner ones say
/// nothing that doubles can hold.
[[nodiscard]] std::vector<FacetSlab> facet_slabs(const Polytope& polytope, const Polytope::Block& block,
                                                 double resolution);

}  // namespace wheelwright

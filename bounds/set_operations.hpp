// SPDX-License-Identifier: Apache-2.0
/// \file
/// Inclusion and intersection of sets of parameters.
#pragma once

#include <limits>
#include <span>
#include <variant>
#include <vector>

#include <wheelwright/bounds/parameter_set.hpp>
#include <wheelwright/bounds/polytope.hpp>

namespace wheelwright {

/// { θ : θ in every set } for sets of the same parameters, such as the feasible sets of several drives of one robot:
/// all facets together. The result is the intersection, or the facets whose multipliers prove (proves_empty, over the
/// smallest box that contains all hulls) that there is none: the drives contradict each other. Throws InvalidArgument
/// when there is no set or the dimensions disagree.
[[nodiscard]] std::variant<Polytope, std::vector<WeightedRow>> intersection(std::span<const Polytope> sets,
                                                                            const PolytopeOptions& options = {});

/// How far `inner` may stick out of { θ : a·θ <= b for every facet }: the largest h(a) − b, rounded outward, relative
/// to the width of `inner` across a. Where it is <= 0, inclusion is proved; a small positive number, such as 1e-10,
/// says that inclusion holds to rounding. Throws InvalidArgument when the dimensions disagree.
template <ParameterSet Inner>
[[nodiscard]] double protrusion(std::span<const HalfSpace> outer, const Inner& inner) {
  double worst = -std::numeric_limits<double>::infinity();
  for (const HalfSpace& facet : outer) {
    check::that(facet.a.size() == static_cast<Eigen::Index>(inner.dimension()), "inclusion", "sets of one dimension");
    const std::span<const double> a(facet.a.data(), inner.dimension());
    // The difference of two doubles has the exact sign; the quotient keeps it.
    constexpr double kLeast = std::numeric_limits<double>::min();
    const double out = inner.support(a) - facet.b, relative = out / std::max(width(inner, a), kLeast);
    worst = std::max(worst, out > 0.0 ? std::max(relative, kLeast) : relative);
  }
  return worst;
}

/// Whether inclusion of `inner` in the polytope is proved, facet by facet: false says that it is not proved. A
/// polytope's support is rounded outward (Polytope::looseness), so a set that touches a facet from inside may go
/// unproved; see protrusion(). Throws InvalidArgument when the dimensions disagree.
template <ParameterSet Inner>
[[nodiscard]] bool includes(const Polytope& outer, const Inner& inner) {
  return protrusion(outer.facets(), inner) <= 0.0;
}

/// The same for two polytopes, where facets that both have are no obstacle: a polytope includes itself.
[[nodiscard]] bool includes(const Polytope& outer, const Polytope& inner);

/// Whether inclusion of `inner` in the box is proved.
template <ParameterSet Inner>
[[nodiscard]] bool includes(const Box& outer, const Inner& inner) {
  return protrusion(sides_as_rows(outer), inner) <= 0.0;
}

}  // namespace wheelwright

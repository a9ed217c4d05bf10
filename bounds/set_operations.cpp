// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/set_operations.hpp>

#include <algorithm>

namespace wheelwright {

std::variant<Polytope, std::vector<WeightedRow>> intersection(std::span<const Polytope> sets,
                                                              const PolytopeOptions& options) {
  check::that(!sets.empty(), "intersection", "at least one set");
  Box box = sets.front().hull();
  std::vector<HalfSpace> rows;
  for (const Polytope& set : sets) {
    box = hull(box, set.hull());
    rows.insert(rows.end(), set.facets().begin(), set.facets().end());
  }
  return Polytope::intersect(rows, box, options);
}

bool includes(const Polytope& outer, const Polytope& inner) {
  check::that(outer.dimension() == inner.dimension(), "inclusion", "sets of one dimension");
  return std::all_of(outer.facets().begin(), outer.facets().end(), [&](const HalfSpace& facet) {
    const bool shared = std::any_of(inner.facets().begin(), inner.facets().end(),
                                    [&](const HalfSpace& own) { return own.b <= facet.b && own.a == facet.a; });
    return shared || inner.support({facet.a.data(), inner.dimension()}) <= facet.b;
  });
}

}  // namespace wheelwright

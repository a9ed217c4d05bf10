// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/facet_slabs.hpp>

#include <algorithm>
#include <limits>

namespace wheelwright {
namespace {

/// The slab lower <= a·θ <= upper, its half-width rounded outward and at least `least`.
FacetSlab between(Eigen::VectorXd a, double lower, double upper, double least) {
  const double middle = Interval{lower, upper}.centre();
  return {std::move(a), middle, std::max({round_up(upper - middle), round_up(middle - lower), least})};
}

}  // namespace

std::vector<FacetSlab> facet_slabs(const Polytope& polytope, const Polytope::Block& block, double resolution) {
  const auto q = static_cast<Eigen::Index>(block.parameters.size());
  Eigen::VectorXd largest(q);
  for (Eigen::Index k = 0; k < q; ++k) {
    const Interval& side = polytope.hull().sides[block.parameters[static_cast<std::size_t>(k)]];
    largest[k] = std::max(std::abs(side.lower), std::abs(side.upper));
  }
  const double unit = resolution * std::numeric_limits<double>::epsilon();
  const auto least = [&](const Eigen::VectorXd& a) { return unit * a.cwiseAbs().dot(largest) + 1e-140; };

  std::vector<FacetSlab> slabs;
  std::vector<bool> done(block.facets.size(), false);
  std::vector<double> opposite(polytope.dimension(), 0.0);
  for (std::size_t i = 0; i < block.facets.size(); ++i) {
    const HalfSpace& facet = block.facets[i];
    if (done[i]) {
      continue;
    }
    double lower = 0.0;
    const auto facing = std::find_if(block.facets.begin() + static_cast<std::ptrdiff_t>(i) + 1, block.facets.end(),
                                     [&](const HalfSpace& other) { return other.a == -facet.a; });
    if (facing != block.facets.end()) {
      done[static_cast<std::size_t>(facing - block.facets.begin())] = true;
      lower = -facing->b;
    } else {
      for (Eigen::Index k = 0; k < q; ++k) {
        opposite[block.parameters[static_cast<std::size_t>(k)]] = -facet.a[k];
      }
      lower = -polytope.support(opposite);
    }
    slabs.push_back(between(facet.a, std::min(lower, facet.b), facet.b, least(facet.a)));
  }
  for (Eigen::Index k = 0; k < q; ++k) {
    const Interval& side = polytope.hull().sides[block.parameters[static_cast<std::size_t>(k)]];
    const Eigen::VectorXd axis = Eigen::VectorXd::Unit(q, k);
    slabs.push_back(between(axis, side.lower, side.upper, least(axis)));
  }
  return slabs;
}

}  // namespace wheelwright

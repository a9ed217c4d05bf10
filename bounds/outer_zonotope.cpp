// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numeric>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <wheelwright/bounds/ellipsoid.hpp>
#include <wheelwright/bounds/facet_slabs.hpp>
#include <wheelwright/bounds/zonogon.hpp>
#include <wheelwright/bounds/zonotope.hpp>

namespace wheelwright {
namespace {

/// Least factor by which one step may change det M: a column that spans a direction alone is not dropped at once.
constexpr double kLeastGeneratorFactor = 0.1;

/// Minimises trace M⁻¹ + Σ s over s >= 0, M = Σ s_i g_i g_iᵀ, for columns g_i.
class Design {
 public:
  explicit Design(Eigen::MatrixXd columns)
      : g_(std::move(columns)), s_(Eigen::VectorXd::Ones(g_.cols())), allowed_(static_cast<std::size_t>(g_.cols())) {
    std::iota(allowed_.begin(), allowed_.end(), Eigen::Index{0});
  }

  /// False where doubles do not suffice. At the optimum |M⁻¹g_i| <= 1 for all columns, with equality where s_i > 0.
  bool minimise(double tolerance, std::size_t cycles) {
    for (std::size_t cycle = 0; cycle < cycles; ++cycle) {
      if (!refresh()) {
        return false;
      }
      double worst = 0.0;
      for (const Eigen::Index i : allowed_) {
        const double size = (inverse_ * g_.col(i)).norm();
        worst = std::max(worst, s_[i] > 0.0 ? std::abs(size - 1.0) : size - 1.0);
      }
      if (worst <= tolerance) {
        break;
      }
      for (const Eigen::Index i : allowed_) {
        step(i);
      }
    }
    return refresh();
  }

  /// Keeps at most `limit` columns with s > 0 (at least as many as there are rows).
  bool reduce(std::size_t limit, double tolerance, std::size_t cycles) {
    while (true) {
      std::erase_if(allowed_, [&](Eigen::Index i) { return s_[i] == 0.0; });
      if (allowed_.size() <= limit) {
        return minimise(tolerance, cycles);
      }
      // The smallest goes, unless it is needed to span the space: then its leverage s g·M⁻¹g is one. Leverages sum to
      // the number of rows, so some column has less.
      const auto cost = [&](Eigen::Index i) {
        const Eigen::VectorXd u = inverse_ * g_.col(i);
        return s_[i] * u.norm() / std::max(1.0 - s_[i] * g_.col(i).dot(u), 1e-12);
      };
      const auto least = std::min_element(allowed_.begin(), allowed_.end(),
                                          [&](Eigen::Index i, Eigen::Index j) { return cost(i) < cost(j); });
      s_[*least] = 0.0;
      allowed_.erase(least);
      if (!minimise(tolerance, 5)) {
        return false;
      }
    }
  }

  /// The columns in use.
  [[nodiscard]] std::vector<Eigen::Index> support() const {
    std::vector<Eigen::Index> used;
    for (const Eigen::Index i : allowed_) {
      if (s_[i] > 0.0) {
        used.push_back(i);
      }
    }
    return used;
  }
  /// s_i M⁻¹ g_i: the sum of its products with g_iᵀ is the identity.
  [[nodiscard]] Eigen::VectorXd dual(Eigen::Index i) const { return s_[i] * (inverse_ * g_.col(i)); }

 private:
  bool refresh() {
    factor_.compute(g_ * s_.asDiagonal() * g_.transpose());
    if (factor_.info() != Eigen::Success) {
      return false;
    }
    inverse_ = factor_.solve(Eigen::MatrixXd::Identity(g_.rows(), g_.rows()));
    return inverse_.allFinite();
  }

  /// Exact minimisation over s_i: with s_i + t and v = g·M⁻¹g the trace falls by t|M⁻¹g|²/(1 + tv), so 1 + tv = |M⁻¹g|.
  void step(Eigen::Index i) {
    const Eigen::VectorXd u = inverse_ * g_.col(i);
    const double v = g_.col(i).dot(u);
    if (!(v > 0.0)) {
      return;
    }
    const double best = std::max(u.norm(), kLeastGeneratorFactor), zero = 1.0 - s_[i] * v;
    const double t = best > zero ? (best - 1.0) / v : -s_[i], factor = std::max(best, zero);
    if (std::isfinite(t) && t != 0.0) {
      s_[i] = best > zero ? s_[i] + t : 0.0;
      inverse_ -= (t / factor) * u * u.transpose();
    }
  }

  Eigen::MatrixXd g_;
  Eigen::VectorXd s_;
  std::vector<Eigen::Index> allowed_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::MatrixXd inverse_;
};

/// Proves that c + Σ_i Λ_i w_i ξ_i, enlarged by the radius that this computes, contains all θ of the box in the slabs:
///
///     θ − c = Σ_i Λ_i (a_i·(θ − c)) + (I − Σ_i Λ_i a_iᵀ)(θ − c),   a_i·(θ − c) = (m_i − a_i·c) + w_i ξ_i.
///
/// Two passes: the first moves the centre by Σ_i Λ_i (m_i − a_i·c), so that little of it is left for the second.
bool enclose(const std::vector<FacetSlab>& slabs, const Eigen::MatrixXd& lambda, const Box& within,
             Zonotope::Block& block) {
  const Eigen::Index q = block.centre.size();
  for (int pass = 0; pass < 2; ++pass) {
    if (!lambda.allFinite() || !block.centre.allFinite()) {
      return false;
    }
    for (Eigen::Index j = 0; j < q; ++j) {
      Interval offset = point(0.0);
      std::vector<Interval> rest(static_cast<std::size_t>(q), point(0.0));
      rest[static_cast<std::size_t>(j)] = point(1.0);
      double radius = 0.0;
      for (std::size_t i = 0; i < slabs.size(); ++i) {
        const FacetSlab& slab = slabs[i];
        const auto column = static_cast<Eigen::Index>(i);
        const Interval factor = point(lambda(j, column));
        Interval shift = point(slab.middle);
        for (Eigen::Index k = 0; k < q; ++k) {
          if (slab.a[k] != 0.0) {
            shift = shift - point(slab.a[k]) * point(block.centre[k]);
            Interval& entry = rest[static_cast<std::size_t>(k)];
            entry = entry - factor * point(slab.a[k]);
          }
        }
        offset = offset + factor * shift;
        block.generators(j, column) = lambda(j, column) * slab.half;
        radius = round_up(radius + magnitude(factor * point(slab.half) - point(block.generators(j, column))));
      }
      if (pass == 0) {
        block.radius[j] = offset.centre();
        continue;
      }
      radius = round_up(radius + magnitude(offset));
      for (Eigen::Index k = 0; k < q; ++k) {
        const Interval far = within.sides[static_cast<std::size_t>(k)] - point(block.centre[k]);
        radius = round_up(radius + magnitude(rest[static_cast<std::size_t>(k)] * far));
      }
      block.radius[j] = radius;
    }
    if (pass == 0) {
      block.centre += block.radius;
    }
  }
  return block.generators.allFinite() && block.radius.allFinite();
}

/// The mean width, up to a factor, in the coordinates that make the ellipsoid round.
double size(const Zonotope::Block& block, const Ellipsoid::Block& round) {
  return round.shape.partialPivLu().solve(block.generators).colwise().norm().sum();
}

/// The interval hull of a block as a zonotope.
Zonotope::Block as_zonotope(std::vector<std::size_t> parameters, const Box& within) {
  const auto q = static_cast<Eigen::Index>(parameters.size());
  Zonotope::Block block{std::move(parameters), Eigen::VectorXd(q), Eigen::MatrixXd::Zero(q, q),
                        Eigen::VectorXd::Zero(q)};
  for (Eigen::Index k = 0; k < q; ++k) {
    const Interval& side = within.sides[static_cast<std::size_t>(k)];
    block.centre[k] = side.centre();
    block.generators(k, k) = std::max(round_up(side.upper - block.centre[k]), round_up(block.centre[k] - side.lower));
  }
  return block;
}

/// A zonotope around a block that lies in an ellipsoid; nothing where doubles do not suffice.
std::optional<Zonotope::Block> around(const std::vector<FacetSlab>& slabs, const Ellipsoid::Block& ellipsoid,
                                      const Box& within, const OuterZonotopeOptions& options) {
  const Eigen::Index q = ellipsoid.centre.size();
  Eigen::MatrixXd columns(q, static_cast<Eigen::Index>(slabs.size()));
  for (Eigen::Index i = 0; i < columns.cols(); ++i) {
    const FacetSlab& slab = slabs[static_cast<std::size_t>(i)];
    columns.col(i) = ellipsoid.shape.transpose() * slab.a / slab.half;
  }
  if (!columns.allFinite()) {
    return std::nullopt;
  }
  Design design(std::move(columns));
  if (!design.minimise(options.tolerance, options.cycles) ||
      !design.reduce(options.order * static_cast<std::size_t>(q), options.tolerance, options.cycles)) {
    return std::nullopt;
  }
  std::vector<FacetSlab> used;
  const std::vector<Eigen::Index> support = design.support();
  Eigen::MatrixXd lambda(q, static_cast<Eigen::Index>(support.size()));
  for (const Eigen::Index i : support) {
    const FacetSlab& slab = slabs[static_cast<std::size_t>(i)];
    lambda.col(static_cast<Eigen::Index>(used.size())) = ellipsoid.shape * design.dual(i) / slab.half;
    used.push_back(slab);
  }
  Zonotope::Block block{ellipsoid.parameters, ellipsoid.centre, lambda, Eigen::VectorXd::Zero(q)};
  return enclose(used, lambda, within, block) ? std::optional(std::move(block)) : std::nullopt;
}

}  // namespace

Zonotope outer_zonotope(const Polytope& polytope, const OuterZonotopeOptions& options) {
  check::that(options.order >= 1, "order of an outer zonotope", "at least 1");
  check::positive(options.tolerance, "tolerance of an outer zonotope");
  const Ellipsoid ellipsoid = outer_ellipsoid(polytope);
  std::vector<Zonotope::Block> blocks;
  for (std::size_t b = 0; b < polytope.blocks().size(); ++b) {
    const Polytope::Block& block = polytope.blocks()[b];
    Box within;
    for (const std::size_t j : block.parameters) {
      within.sides.push_back(polytope.hull().sides[j]);
    }
    std::optional<Zonotope::Block> best;
    for (const double resolution : {64.0, 4096.0, 262144.0}) {
      if (block.parameters.size() > 1 && !best) {
        best = around(facet_slabs(polytope, block, resolution), ellipsoid.blocks()[b], within, options);
      }
    }
    if (auto zonogon = outer_zonogon(polytope, block, ellipsoid.blocks()[b], 2 * options.order)) {
      if (!best || size(*zonogon, ellipsoid.blocks()[b]) < size(*best, ellipsoid.blocks()[b])) {
        best = std::move(zonogon);
      }
    }
    blocks.push_back(best ? std::move(*best) : as_zonotope(block.parameters, within));
  }
  return Zonotope(std::move(blocks));
}

}  // namespace wheelwright

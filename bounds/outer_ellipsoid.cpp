// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include <wheelwright/bounds/ellipsoid.hpp>
#include <wheelwright/bounds/facet_slabs.hpp>
#include <wheelwright/bounds/vertex_ellipsoid.hpp>

namespace wheelwright {
namespace {

using Criterion = OuterEllipsoidOptions::Criterion;

/// Least factor by which one step may change det M: a slab that bounds a direction alone is not dropped at once.
constexpr double kLeastFactor = 0.1;

/// A bound of |u| over all θ = centre + shape u with Σ weight_i ((a_i·θ − m_i)² − w_i²) <= 0, for any weights >= 0:
/// with g_i = shapeᵀa_i and δ_i = a_i·centre − m_i the condition reads uᵀGu + 2h·u + k <= 0, and |G − I| <= e gives
///
///     (1 − e)|u|² − 2|h||u| + k <= 0.
///
/// Everything is enclosed. Nothing where e is not below one half: then shape may be singular.
std::optional<double> certified_radius(const std::vector<FacetSlab>& slabs, const Eigen::VectorXd& weights,
                                       const Eigen::VectorXd& centre, const Eigen::MatrixXd& shape) {
  const Eigen::Index q = centre.size();
  std::vector<Interval> gram(static_cast<std::size_t>(q * q), point(0.0)), linear(static_cast<std::size_t>(q));
  std::vector<Interval> g(static_cast<std::size_t>(q));
  Interval constant = point(0.0);
  for (std::size_t i = 0; i < slabs.size(); ++i) {
    const double weight = weights[static_cast<Eigen::Index>(i)];
    if (!(weight > 0.0)) {
      continue;
    }
    const FacetSlab& slab = slabs[i];
    Interval delta = point(-slab.middle);
    std::fill(g.begin(), g.end(), point(0.0));
    for (Eigen::Index j = 0; j < q; ++j) {
      if (slab.a[j] != 0.0) {
        delta = delta + point(slab.a[j]) * point(centre[j]);
        for (Eigen::Index k = 0; k < q; ++k) {
          Interval& entry = g[static_cast<std::size_t>(k)];
          entry = entry + point(slab.a[j]) * point(shape(j, k));
        }
      }
    }
    constant = constant + point(weight) * (delta * delta - point(slab.half) * point(slab.half));
    for (Eigen::Index k = 0; k < q; ++k) {
      const Interval scaled = point(weight) * g[static_cast<std::size_t>(k)];
      Interval& entry = linear[static_cast<std::size_t>(k)];
      entry = entry + scaled * delta;
      for (Eigen::Index l = k; l < q; ++l) {
        Interval& product = gram[static_cast<std::size_t>(k * q + l)];
        product = product + scaled * g[static_cast<std::size_t>(l)];
      }
    }
  }
  double error_squares = 0.0, linear_squares = 0.0;
  for (Eigen::Index k = 0; k < q; ++k) {
    const double h = magnitude(linear[static_cast<std::size_t>(k)]);
    linear_squares = round_up(linear_squares + round_up(h * h));
    for (Eigen::Index l = k; l < q; ++l) {
      const double x = magnitude(gram[static_cast<std::size_t>(k * q + l)] - point(k == l ? 1.0 : 0.0));
      error_squares = round_up(error_squares + round_up((k == l ? 1.0 : 2.0) * round_up(x * x)));
    }
  }
  const double least = round_down(1.0 - round_up(std::sqrt(error_squares))), h = round_up(std::sqrt(linear_squares));
  const double rest = std::max(0.0, -constant.lower);
  if (!(least > 0.5) || !std::isfinite(h) || !std::isfinite(rest)) {
    return std::nullopt;
  }
  const double root = round_up(std::sqrt(round_up(linear_squares + round_up(least * rest))));
  return round_up(round_up(h + root) / least);
}

/// Scales the shape until |u| <= 1 is proved; whether it was.
bool enclose(const std::vector<FacetSlab>& slabs, Eigen::VectorXd weights, Ellipsoid::Block& block) {
  for (int attempt = 0; attempt < 8; ++attempt) {
    if (!block.centre.allFinite() || !block.shape.allFinite() || !weights.allFinite()) {
      return false;
    }
    const std::optional<double> radius = certified_radius(slabs, weights, block.centre, block.shape);
    if (!radius || *radius <= 1.0) {
      return radius.has_value();
    }
    const double factor = *radius * (1.0 + 1e-15);
    block.shape *= factor;
    weights /= factor * factor;
  }
  return false;
}

/// The weights λ of slabs |g·z − μ| <= 1, in coordinates where the block has size about one: M = Σ λ g gᵀ, its centre
/// M⁻¹ Σ λ μ g, and κ = Σ λ (1 − (g·centre − μ)²), so that E = { (z − centre)ᵀM(z − centre) <= κ }.
class WeightFit {
 public:
  WeightFit(const std::vector<FacetSlab>& slabs, const Coordinates& coordinates, const Eigen::VectorXd& half_sides)
      : g_(coordinates.transform.rows(), static_cast<Eigen::Index>(slabs.size())), mu_(g_.cols()) {
    for (Eigen::Index i = 0; i < g_.cols(); ++i) {
      const FacetSlab& slab = slabs[static_cast<std::size_t>(i)];
      g_.col(i) = coordinates.transform.transpose() * slab.a / slab.half;
      mu_[i] = (slab.middle - slab.a.dot(coordinates.centre)) / slab.half;
    }
    const Eigen::MatrixXd relative = half_sides.cwiseInverse().asDiagonal() * coordinates.transform;
    measure_ = relative.transpose() * relative;
    weights_ = Eigen::VectorXd::Ones(g_.cols());
  }

  /// Minimises the criterion; false where doubles do not suffice.
  bool minimise(const OuterEllipsoidOptions& options) {
    for (std::size_t cycle = 0; cycle < options.cycles; ++cycle) {
      if (!refresh()) {
        return false;
      }
      if (violation(options.criterion) <= options.tolerance) {
        return true;
      }
      for (Eigen::Index i = 0; i < g_.cols(); ++i) {
        step(i, options.criterion);
      }
    }
    return refresh();
  }

  [[nodiscard]] const Eigen::VectorXd& weights() const { return weights_; }  ///< scaled so that κ = 1
  [[nodiscard]] const Eigen::VectorXd& centre() const { return centre_; }
  /// S with SSᵀ = M⁻¹, so that E = { centre + S u : |u| <= 1 }.
  [[nodiscard]] Eigen::MatrixXd shape() const {
    return factor_.matrixU().solve(Eigen::MatrixXd::Identity(g_.rows(), g_.rows()));
  }

 private:
  /// Computes everything afresh from the weights, and scales them so that κ = 1.
  bool refresh() {
    for (int pass = 0; pass < 2; ++pass) {
      factor_.compute(g_ * weights_.asDiagonal() * g_.transpose());
      if (factor_.info() != Eigen::Success) {
        return false;
      }
      centre_ = factor_.solve(g_ * weights_.cwiseProduct(mu_));
      const Eigen::VectorXd residuals = g_.transpose() * centre_ - mu_;
      kappa_ = weights_.dot((1.0 - residuals.array().square()).matrix());
      if (!(kappa_ > 0.0) || !std::isfinite(kappa_)) {
        return false;
      }
      weights_ /= kappa_;
    }
    kappa_ = 1.0;
    inverse_ = factor_.solve(Eigen::MatrixXd::Identity(g_.rows(), g_.rows()));
    trace_ = inverse_.cwiseProduct(measure_).sum();
    return inverse_.allFinite();
  }

  /// By how much the derivative with respect to some λ_i calls for more of it: with κ = 1, volume has its minimum where
  /// r_i² + v_i/p <= 1 for all slabs, the trace where r_i² + w_i/trace <= 1 (r residual at the centre, v = g·M⁻¹g,
  /// w = |M⁻¹g|² in the measure); the λ-weighted mean of the left sides is 1 always.
  [[nodiscard]] double violation(Criterion criterion) const {
    double worst = 0.0;
    for (Eigen::Index i = 0; i < g_.cols(); ++i) {
      const Eigen::VectorXd u = inverse_ * g_.col(i);
      const double r = g_.col(i).dot(centre_) - mu_[i];
      const double share = criterion == Criterion::volume ? g_.col(i).dot(u) / static_cast<double>(g_.rows())
                                                          : u.dot(measure_ * u) / trace_;
      worst = std::max(worst, r * r + share - 1.0);
    }
    return worst;
  }

  /// Exact minimisation over λ_i, λ_i >= 0: with λ_i + t, s = 1 + tv multiplies det M, κ becomes κ + t − t r²/s and
  /// trace M⁻¹ falls by t w/s.
  void step(Eigen::Index i, Criterion criterion) {
    const Eigen::VectorXd u = inverse_ * g_.col(i);
    const double v = g_.col(i).dot(u), r = mu_[i] - g_.col(i).dot(centre_), w = u.dot(measure_ * u);
    if (!(v > 0.0)) {
      return;
    }
    const double best = criterion == Criterion::volume ? volume_root(v, r * r) : trace_root(v, r * r, w);
    const double zero = 1.0 - weights_[i] * v, s = std::max({best, zero, kLeastFactor});
    const double t = s > zero ? (s - 1.0) / v : -weights_[i];
    if (t == 0.0 || !std::isfinite(t)) {
      return;
    }
    weights_[i] = s > zero ? weights_[i] + t : 0.0;
    inverse_ -= (t / s) * u * u.transpose();
    centre_ += (t / s) * r * u;
    kappa_ += t - t * r * r / s;
    trace_ -= t * w / s;
  }

  /// The positive root of (p − 1)s² − (vκ − 1 − r²)s − (p + 1)r² = 0, the stationary point of p log κ − log det M.
  [[nodiscard]] double volume_root(double v, double rr) const {
    const auto p = static_cast<double>(g_.rows());
    const double linear = v * kappa_ - 1.0 - rr, root = std::sqrt(linear * linear + 4.0 * (p * p - 1.0) * rr);
    // Without cancellation, whatever the sign.
    return linear >= 0.0 ? (linear + root) / (2.0 * (p - 1.0)) : 2.0 * (p + 1.0) * rr / (root - linear);
  }

  /// The positive root of (τ − ω)s³ − (r²(τ − ω) + wκ − ω − ωr²)s − 2ωr² = 0 with ω = w/v, the stationary point of
  /// κ trace M⁻¹: one change of sign, hence one root; Newton's method from above.
  [[nodiscard]] double trace_root(double v, double rr, double w) const {
    const double omega = w / v, cubic = trace_ - omega;
    const double linear = rr * cubic + w * kappa_ - omega - omega * rr, constant = 2.0 * omega * rr;
    if (!(cubic > 0.0)) {
      return 1.0;
    }
    double s = std::max(1.0, std::sqrt(2.0 * std::max(0.0, linear) / cubic)) + std::cbrt(2.0 * constant / cubic);
    for (int k = 0; k < 60; ++k) {
      const double value = (cubic * s * s - linear) * s - constant, slope = 3.0 * cubic * s * s - linear;
      if (!(slope > 0.0) || value == 0.0) {
        break;
      }
      const double next = s - value / slope;
      if (!(next < s) || next <= 0.0) {
        break;
      }
      s = next;
    }
    return s;
  }

  Eigen::MatrixXd g_;
  Eigen::VectorXd mu_;
  Eigen::MatrixXd measure_;  ///< θ's distance, relative to the hull, in z
  Eigen::VectorXd weights_, centre_;
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::MatrixXd inverse_;
  double kappa_ = 1.0, trace_ = 0.0;
};

/// What the criterion makes small, up to a factor: of blocks with the same parameters the smaller is the better.
double measure(const Ellipsoid::Block& block, const Eigen::VectorXd& half_sides, Criterion criterion) {
  const Eigen::MatrixXd relative = half_sides.cwiseInverse().asDiagonal() * block.shape;
  return criterion == Criterion::volume ? std::abs(relative.determinant()) : relative.squaredNorm();
}

/// The best ellipsoid from slabs; nothing where they are too flat for doubles.
std::optional<Ellipsoid::Block> around_slabs(const Polytope& polytope, const Polytope::Block& block,
                                             const Eigen::VectorXd& half_sides, const OuterEllipsoidOptions& options) {
  for (const double resolution : {64.0, 4096.0, 262144.0}) {
    const std::vector<FacetSlab> slabs = facet_slabs(polytope, block, resolution);
    WeightFit fit(slabs, block.coordinates, half_sides);
    if (!fit.minimise(options)) {
      continue;
    }
    Ellipsoid::Block fitted{block.parameters, block.coordinates.centre + block.coordinates.transform * fit.centre(),
                            block.coordinates.transform * fit.shape()};
    Eigen::VectorXd weights = fit.weights();
    for (std::size_t i = 0; i < slabs.size(); ++i) {
      weights[static_cast<Eigen::Index>(i)] /= slabs[i].half * slabs[i].half;
    }
    if (enclose(slabs, weights, fitted)) {
      return fitted;
    }
  }
  return std::nullopt;
}

Ellipsoid::Block around(const Polytope& polytope, const Polytope::Block& block, const OuterEllipsoidOptions& options) {
  const auto q = static_cast<Eigen::Index>(block.parameters.size());
  Ellipsoid::Block result{block.parameters, Eigen::VectorXd(q), Eigen::MatrixXd::Zero(q, q)};
  Eigen::VectorXd half_sides(q);
  for (Eigen::Index k = 0; k < q; ++k) {
    const Interval& side = polytope.hull().sides[block.parameters[static_cast<std::size_t>(k)]];
    result.centre[k] = side.centre();
    half_sides[k] = std::max(round_up(side.upper - result.centre[k]), round_up(result.centre[k] - side.lower));
  }
  if (q == 1) {
    result.shape(0, 0) = half_sides[0];
    return result;
  }
  const Eigen::VectorXd units = half_sides.cwiseMax(1e-140);
  std::optional<Ellipsoid::Block> best = around_slabs(polytope, block, units, options);
  const std::optional<VertexSet> vertices =
      block.vertices ? block.vertices : enumerate_vertices(block.facets, block.coordinates, options.vertex_limit);
  if (vertices) {
    if (auto fitted = vertex_ellipsoid(*vertices, block.coordinates, options.tolerance, options.cycles)) {
      Ellipsoid::Block other{block.parameters, std::move(fitted->centre), std::move(fitted->shape)};
      if (!best || measure(other, units, options.criterion) < measure(*best, units, options.criterion)) {
        best = std::move(other);
      }
    }
  }
  if (best) {
    return *best;
  }
  // The ellipsoid of the interval hull: Σ_j ((θ_j − c_j)/half_j)² <= q holds for every θ of the box.
  for (Eigen::Index k = 0; k < q; ++k) {
    result.shape(k, k) = round_up(round_up(std::sqrt(static_cast<double>(q))) * half_sides[k]);
  }
  return result;
}

}  // namespace

Ellipsoid outer_ellipsoid(const Polytope& polytope, const OuterEllipsoidOptions& options) {
  check::positive(options.tolerance, "tolerance of an outer ellipsoid");
  std::vector<Ellipsoid::Block> blocks;
  for (const Polytope::Block& block : polytope.blocks()) {
    blocks.push_back(around(polytope, block, options));
  }
  return Ellipsoid(std::move(blocks));
}

}  // namespace wheelwright

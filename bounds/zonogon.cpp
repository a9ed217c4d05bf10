// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/zonogon.hpp>

#include <algorithm>
#include <cmath>

#include <Eigen/LU>

namespace wheelwright {
namespace {

using Points = std::vector<Eigen::Vector2d>;

double cross(const Eigen::Vector2d& x, const Eigen::Vector2d& y) { return x[0] * y[1] - x[1] * y[0]; }

/// Half the edges of conv{ ±(point − centre) }, one of each pair of parallel ones, by ascending angle: Andrew's
/// monotone chain, whose lower half is enough.
Points half_edges(const Points& points, const Eigen::Vector2d& centre) {
  Points all;
  for (const Eigen::Vector2d& point : points) {
    all.push_back(point - centre);
    all.push_back(centre - point);
  }
  std::sort(all.begin(), all.end(),
            [](const auto& x, const auto& y) { return x[0] < y[0] || (x[0] == y[0] && x[1] < y[1]); });
  Points chain;
  for (const Eigen::Vector2d& point : all) {
    while (chain.size() > 1 && cross(chain.back() - chain[chain.size() - 2], point - chain[chain.size() - 2]) <= 0.0) {
      chain.pop_back();
    }
    chain.push_back(point);
  }
  // The lower chain runs from one extreme point to its opposite: half the boundary, and so one edge of each pair.
  Points edges;
  for (std::size_t i = 0; i + 1 < chain.size(); ++i) {
    edges.emplace_back(0.5 * (chain[i + 1] - chain[i]));
  }
  return edges;
}

double length(const Points& edges) {
  double sum = 0.0;
  for (const Eigen::Vector2d& edge : edges) {
    sum += edge.norm();
  }
  return sum;
}

/// The centre of least perimeter, for points in the unit circle.
Eigen::Vector2d best_centre(const Points& points) {
  Eigen::Vector2d best = Eigen::Vector2d::Zero();
  double least = length(half_edges(points, best));
  for (double step = 0.25; step > 1e-9;) {
    bool moved = false;
    for (const Eigen::Vector2d& direction :
         {Eigen::Vector2d(1, 0), Eigen::Vector2d(-1, 0), Eigen::Vector2d(0, 1), Eigen::Vector2d(0, -1),
          Eigen::Vector2d(1, 1), Eigen::Vector2d(-1, -1), Eigen::Vector2d(1, -1), Eigen::Vector2d(-1, 1)}) {
      const Eigen::Vector2d other = best + step * direction;
      const double size = length(half_edges(points, other));
      if (size < least) {
        least = size;
        best = other;
        moved = true;
      }
    }
    step = moved ? step : 0.5 * step;
  }
  return best;
}

/// Replaces edges by their neighbours in angle (the last before the first, reversed) until at most `limit` are left.
void reduce(Points& edges, std::size_t limit) {
  while (edges.size() > std::max<std::size_t>(limit, 2)) {
    const std::size_t m = edges.size();
    std::size_t least = 0;
    double least_growth = std::numeric_limits<double>::infinity();
    Eigen::Vector2d least_parts = Eigen::Vector2d::Zero();
    for (std::size_t i = 0; i < m; ++i) {
      Eigen::Matrix2d neighbours;
      neighbours << edges[(i + m - 1) % m], edges[(i + 1) % m];
      const Eigen::Vector2d parts = neighbours.partialPivLu().solve(edges[i]).cwiseAbs();
      const double growth = parts.dot(neighbours.colwise().norm().transpose()) - edges[i].norm();
      if (growth < least_growth) {
        least = i;
        least_growth = growth;
        least_parts = parts;
      }
    }
    edges[(least + m - 1) % m] *= 1.0 + least_parts[0];
    edges[(least + 1) % m] *= 1.0 + least_parts[1];
    edges.erase(edges.begin() + static_cast<std::ptrdiff_t>(least));
  }
}

/// By which factor the generators must grow for the zonogon to contain the block, rounded up; nothing where it is not
/// proved to have an interior.
std::optional<double> certified_factor(const Polytope& polytope, const Zonotope::Block& zonogon) {
  const auto point = [](double x) { return Interval{x, x}; };
  const Eigen::MatrixXd& g = zonogon.generators;
  std::vector<double> normal(polytope.dimension(), 0.0);
  double factor = 0.0;
  for (Eigen::Index i = 0; i < g.cols(); ++i) {
    double size = 0.0;
    for (Eigen::Index k = 0; k < g.cols(); ++k) {
      const Interval product = point(g(0, i)) * point(g(1, k)) - point(g(1, i)) * point(g(0, k));
      size = std::max(0.0, round_down(size + std::max({0.0, product.lower, -product.upper})));
    }
    if (!(size > 0.0) || !std::isfinite(size)) {
      return std::nullopt;
    }
    for (const double sign : {1.0, -1.0}) {
      const Eigen::Vector2d n(-sign * g(1, i), sign * g(0, i));
      normal[zonogon.parameters[0]] = n[0];
      normal[zonogon.parameters[1]] = n[1];
      const Interval at = point(n[0]) * point(zonogon.centre[0]) + point(n[1]) * point(zonogon.centre[1]);
      factor = std::max(factor, round_up(round_up(polytope.support(normal) - at.lower) / size));
    }
  }
  return std::isfinite(factor) ? std::optional(factor) : std::nullopt;
}

}  // namespace

std::optional<Zonotope::Block> outer_zonogon(const Polytope& polytope, const Polytope::Block& block,
                                             const Ellipsoid::Block& round, std::size_t limit) {
  if (block.parameters.size() != 2 || !block.vertices) {
    return std::nullopt;
  }
  const Eigen::MatrixXd z = round.shape.partialPivLu().solve(block.vertices->points.colwise() - round.centre);
  if (!z.allFinite()) {
    return std::nullopt;
  }
  Points points;
  for (Eigen::Index v = 0; v < z.cols(); ++v) {
    points.emplace_back(z.col(v));
  }
  const Eigen::Vector2d centre = best_centre(points);
  Points edges = half_edges(points, centre);
  const double negligible = 1e-8 * length(edges);
  std::erase_if(edges, [&](const Eigen::Vector2d& edge) { return edge.norm() <= negligible; });
  reduce(edges, limit);

  Zonotope::Block result{block.parameters, round.centre + round.shape * centre,
                         Eigen::MatrixXd(2, static_cast<Eigen::Index>(edges.size())), Eigen::VectorXd::Zero(2)};
  for (std::size_t i = 0; i < edges.size(); ++i) {
    result.generators.col(static_cast<Eigen::Index>(i)) = round.shape * edges[i];
  }
  for (int attempt = 0; attempt < 8 && result.generators.allFinite() && result.centre.allFinite(); ++attempt) {
    const std::optional<double> factor = certified_factor(polytope, result);
    if (!factor || *factor <= 1.0) {
      return factor ? std::optional(std::move(result)) : std::nullopt;
    }
    result.generators *= *factor * (1.0 + 1e-15);
  }
  return std::nullopt;
}

}  // namespace wheelwright

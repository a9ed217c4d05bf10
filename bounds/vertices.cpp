// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/vertices.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <unordered_map>

#include <Eigen/LU>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/core/limits.hpp>
#include <wheelwright/core/linear_algebra.hpp>

namespace wheelwright {
namespace {

constexpr std::size_t kMaxDimension = 16;

/// The facets that meet in a vertex (p of them) or an edge (p − 1), ascending; unused places hold −1.
using Facets = std::array<int, kMaxDimension>;

struct FacetsHash {
  std::size_t operator()(const Facets& facets) const noexcept {
    std::uint64_t h = 0x9E3779B97F4A7C15ULL;
    for (const int f : facets) {
      h = (h ^ static_cast<std::uint64_t>(static_cast<std::uint32_t>(f))) * 0xBF58476D1CE4E5B9ULL;
      h ^= h >> 29;
    }
    return static_cast<std::size_t>(h);
  }
};

struct Vertex {
  Facets facets;
  Eigen::VectorXd z;
};

Facets without(const Facets& facets, std::size_t place, std::size_t p) {
  Facets edge;
  edge.fill(-1);
  for (std::size_t i = 0, k = 0; i < p; ++i) {
    if (i != place) {
      edge[k++] = facets[i];
    }
  }
  return edge;
}

Facets with(const Facets& edge, int facet, std::size_t p) {
  Facets facets = edge;
  facets[p - 1] = facet;
  std::sort(facets.begin(), facets.begin() + static_cast<std::ptrdiff_t>(p));
  return facets;
}

Eigen::VectorXd meet(const Facets& facets, const Eigen::MatrixXd& normals, const Eigen::VectorXd& b) {
  const Eigen::Index p = normals.rows();
  Eigen::MatrixXd columns(p, p);
  Eigen::VectorXd rhs(p);
  for (Eigen::Index k = 0; k < p; ++k) {
    columns.col(k) = normals.col(facets[static_cast<std::size_t>(k)]);
    rhs[k] = b[facets[static_cast<std::size_t>(k)]];
  }
  return LuFactors(columns.transpose()).solve(rhs);
}

/// Vertices of { z : normalsᵀ z <= b }, whose last p + 1 columns are a simplex around it that must not remain.
std::optional<std::vector<Vertex>> insert_all(const Eigen::MatrixXd& normals, const Eigen::VectorXd& b,
                                              std::size_t limit, bool& too_many) {
  const auto p = static_cast<std::size_t>(normals.rows());
  const auto m = static_cast<int>(normals.cols());
  const int first_artificial = m - static_cast<int>(p) - 1;
  std::vector<Vertex> vertices;
  for (std::size_t left_out = 0; left_out <= p; ++left_out) {
    Vertex vertex;
    vertex.facets.fill(-1);
    for (std::size_t i = 0, k = 0; i <= p; ++i) {
      if (i != left_out) {
        vertex.facets[k++] = first_artificial + static_cast<int>(i);
      }
    }
    vertex.z = meet(vertex.facets, normals, b);
    vertices.push_back(std::move(vertex));
  }
  std::unordered_map<Facets, int, FacetsHash> edges;
  for (int r = 0; r < first_artificial; ++r) {
    edges.clear();
    std::vector<Vertex> kept;
    for (Vertex& vertex : vertices) {
      if (normals.col(r).dot(vertex.z) <= b[r]) {
        kept.push_back(std::move(vertex));
        continue;
      }
      for (std::size_t i = 0; i < p; ++i) {
        ++edges[without(vertex.facets, i, p)];
      }
    }
    for (const auto& [edge, ends] : edges) {
      if (ends == 1) {
        Vertex vertex{with(edge, r, p), {}};
        vertex.z = meet(vertex.facets, normals, b);
        if (!vertex.z.allFinite()) {
          return std::nullopt;
        }
        kept.push_back(std::move(vertex));
      }
    }
    vertices = std::move(kept);
    too_many = vertices.size() > 2 * limit + 64;
    if (vertices.empty() || too_many) {
      return std::nullopt;
    }
  }
  too_many = vertices.size() > limit;
  if (too_many) {
    return std::nullopt;
  }
  for (const Vertex& vertex : vertices) {
    if (vertex.facets[p - 1] >= first_artificial) {
      return std::nullopt;
    }
  }
  return vertices;
}

/// Whether every edge of every vertex ends in exactly one other vertex of the list.
bool closed_under_adjacency(const std::vector<Vertex>& vertices, std::size_t p) {
  std::unordered_map<Facets, int, FacetsHash> edges;
  for (const Vertex& vertex : vertices) {
    for (std::size_t i = 0; i < p; ++i) {
      ++edges[without(vertex.facets, i, p)];
    }
  }
  return std::all_of(edges.begin(), edges.end(), [](const auto& edge) { return edge.second == 2; });
}

/// Encloses the exact vertices of the shifted rows and proves that each lies strictly inside all other rows. On success
/// `result` has points and radius.
bool enclose(const std::vector<Vertex>& vertices, std::span<const HalfSpace> rows, const Eigen::VectorXd& shifted,
             const Coordinates& coordinates, VertexSet& result) {
  const Eigen::Index p = coordinates.centre.size();
  const auto m = static_cast<Eigen::Index>(rows.size());
  const double gamma =
      2.0 * static_cast<double>(p + 4) * kEpsilon;  // roundings of a p-term sum (Higham 2002), four times over
  const Eigen::VectorXd size = coordinates.transform.cwiseAbs().rowwise().sum();
  Eigen::MatrixXd a(p, m);
  for (Eigen::Index i = 0; i < m; ++i) {
    a.col(i) = rows[static_cast<std::size_t>(i)].a;
  }
  const Eigen::MatrixXd a_abs = a.cwiseAbs();
  result.points.resize(p, static_cast<Eigen::Index>(vertices.size()));
  result.radius = Eigen::VectorXd::Zero(p);
  Eigen::MatrixXd basis(p, p);
  Eigen::VectorXd rhs(p);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    for (Eigen::Index k = 0; k < p; ++k) {
      const int f = vertices[v].facets[static_cast<std::size_t>(k)];
      basis.row(k) = a.col(f).transpose();
      rhs[k] = shifted[f];
    }
    const Eigen::MatrixXd inverse = coordinates.transform * wheelwright::inverse(basis * coordinates.transform);
    Eigen::VectorXd theta = coordinates.centre + coordinates.transform * vertices[v].z;
    theta += inverse * (rhs - basis * theta);
    const Eigen::VectorXd residual = rhs - basis * theta;
    const Eigen::VectorXd residual_bound =
        residual.cwiseAbs() * (1.0 + gamma) + gamma * (rhs.cwiseAbs() + basis.cwiseAbs() * theta.cwiseAbs());
    const Eigen::VectorXd step = (1.0 + gamma) * (inverse.cwiseAbs() * residual_bound);
    const Eigen::MatrixXd defect = (Eigen::MatrixXd::Identity(p, p) - inverse * basis).cwiseAbs() * (1.0 + gamma) +
                                   gamma * (inverse.cwiseAbs() * basis.cwiseAbs() + Eigen::MatrixXd::Identity(p, p));
    const double contraction = (1.0 + gamma) * ((defect * size).array() / size.array()).maxCoeff();
    const double longest = (step.array() / size.array()).maxCoeff();
    if (!(contraction < 0.5) || !std::isfinite(longest)) {
      return false;
    }
    // θ* − θ = Z r + (1 − Z A)(θ* − θ), with |1 − Z A| size <= contraction · size.
    const Eigen::VectorXd radius = (step + size * (2.0 * contraction * longest)) * (1.0 + gamma) +
                                   Eigen::VectorXd::Constant(p, std::numeric_limits<double>::min());
    const Eigen::VectorXd doubt = radius + gamma * theta.cwiseAbs();
    for (Eigen::Index i = 0; i < m; ++i) {
      const auto& facets = vertices[v].facets;
      if (std::find(facets.begin(), facets.begin() + p, static_cast<int>(i)) != facets.begin() + p) {
        continue;
      }
      const double slack = shifted[i] - a.col(i).dot(theta);
      if (!(slack > (1.0 + gamma) * a_abs.col(i).dot(doubt) + gamma * std::abs(shifted[i]))) {
        return false;
      }
    }
    result.points.col(static_cast<Eigen::Index>(v)) = theta;
    result.radius = result.radius.cwiseMax(radius);
  }
  return true;
}

}  // namespace

std::optional<VertexSet> enumerate_vertices(std::span<const HalfSpace> rows, const Coordinates& coordinates,
                                            std::size_t limit) {
  const Eigen::Index p = coordinates.centre.size();
  const auto m = static_cast<Eigen::Index>(rows.size());
  if (p < 1 || p > static_cast<Eigen::Index>(kMaxDimension)) {
    return std::nullopt;
  }
  Eigen::MatrixXd normals(p, m + p + 1);
  Eigen::VectorXd b(m + p + 1), norms(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    const HalfSpace& row = rows[static_cast<std::size_t>(i)];
    const Eigen::VectorXd g = coordinates.transform.transpose() * row.a;
    norms[i] = g.norm();
    if (!(norms[i] > 0.0)) {
      return std::nullopt;
    }
    normals.col(i) = g / norms[i];
  }
  constexpr double kAround = 16.0;
  for (Eigen::Index j = 0; j < p; ++j) {
    normals.col(m + j) = -Eigen::VectorXd::Unit(p, j);
    b[m + j] = kAround;
  }
  normals.col(m + p) = Eigen::VectorXd::Ones(p);
  b[m + p] = kAround * static_cast<double>(p);

  bool too_many = false;
  std::mt19937_64 generator(0x5EEDULL);
  for (const double shift : {1e-10, 1e-9, 1e-8, 1e-7, 1e-6}) {
    Eigen::VectorXd shifted(m);
    for (Eigen::Index i = 0; i < m; ++i) {
      const HalfSpace& row = rows[static_cast<std::size_t>(i)];
      const double uniform = static_cast<double>(generator() >> 11) * 0x1.0p-53;
      shifted[i] = round_up(row.b + norms[i] * shift * (1.0 + uniform));
      b[i] = (shifted[i] - row.a.dot(coordinates.centre)) / norms[i];
    }
    const std::optional<std::vector<Vertex>> vertices = insert_all(normals, b, limit, too_many);
    if (too_many) {
      break;
    }
    VertexSet result;
    if (vertices && closed_under_adjacency(*vertices, static_cast<std::size_t>(p)) &&
        enclose(*vertices, rows, shifted, coordinates, result)) {
      result.looseness = 2.0 * shift;
      return result;
    }
  }
  return std::nullopt;
}

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
#include "bounds/polytope.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <unordered_map>

#include <Eigen/Core>

#include "bounds/certificate.hpp"
#include "bounds/cutting_planes.hpp"
#include "bounds/linear_program.hpp"
#include "bounds/slab_rows.hpp"
#include "core/interval.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "core/random.hpp"

namespace wheelwright::bounds {
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
  return core::LuFactors(columns.transpose()).solve(rhs);
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
      2.0 * static_cast<double>(p + 4) * core::kEpsilon;  // roundings of a p-term sum (Higham 2002), four times over
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
    const Eigen::MatrixXd inverse = coordinates.transform * core::inverse(basis * coordinates.transform);
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
      shifted[i] = core::round_up(row.b + norms[i] * shift * (1.0 + core::uniform(generator)));
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

namespace {

CertifiedBound spread(CertifiedBound bound, const std::vector<std::size_t>& parameters, std::size_t p) {
  for (WeightedRow& weighted : bound.binding) {
    weighted.row = spread(weighted.row, parameters, p);
  }
  return bound;
}

/// The facets in z.
void load(Polytope::Block& block) {
  const auto m = static_cast<Eigen::Index>(block.facets.size());
  block.normals.resize(block.coordinates.centre.size(), m);
  block.offsets.resize(m);
  block.norms.resize(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    const HalfSpace& row = block.facets[static_cast<std::size_t>(i)];
    const Eigen::VectorXd g = block.coordinates.transform.transpose() * row.a;
    block.norms[i] = std::max(g.norm(), 1e-300);
    block.normals.col(i) = g / block.norms[i];
    block.offsets[i] = (row.b - row.a.dot(block.coordinates.centre)) / block.norms[i];
  }
}

/// Largest ball inside the rows in θ / half: centre into `block`, radius >= 0.
void find_chebyshev_centre(Polytope::Block& block, const Eigen::VectorXd& half, const Eigen::VectorXd& fallback) {
  const auto p = static_cast<Eigen::Index>(block.parameters.size());
  const auto m = static_cast<Eigen::Index>(block.facets.size());
  Eigen::MatrixXd a(p + 1, m);
  Eigen::VectorXd b(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    const HalfSpace& row = block.facets[static_cast<std::size_t>(i)];
    const Eigen::VectorXd g = block.coordinates.transform.transpose() * row.a;
    const double norm = std::max(g.norm(), 1e-300);
    a.col(i) << g / norm, (row.a.array() * half.array()).matrix().norm() / norm;
    b[i] = (row.b - row.a.dot(block.coordinates.centre)) / norm;
  }
  // The block lies in about [-1, 1] in z, and its ball is smaller than its hull.
  const Eigen::VectorXd limit = Eigen::VectorXd::Constant(p + 1, 8.0);
  LinearProgram program(-limit, limit);
  program.add_rows(a, b);
  const LpSolution solution = program.maximise(Eigen::VectorXd::Unit(p + 1, p));
  block.chebyshev_centre = fallback;
  if (solution.status == LpSolution::Status::optimal) {
    block.chebyshev_centre = block.coordinates.centre + block.coordinates.transform * solution.x.head(p);
    block.chebyshev_radius = std::max(0.0, solution.value);
  }
}

/// Certified maximum of a·θ over a block by a linear program, `at` a maximiser; the support of `within` where it fails.
double certified_support(const Polytope::Block& block, const Eigen::VectorXd& a, const Box& within,
                         Eigen::VectorXd& at) {
  const std::span<const double> direction(a.data(), static_cast<std::size_t>(a.size()));
  at.resize(a.size());
  const double outer = within.support(direction, {at.data(), direction.size()});
  const Eigen::VectorXd c = block.coordinates.transform.transpose() * a;
  if (!(c.norm() > 0.0)) {
    return outer;
  }
  const Eigen::VectorXd limit = Eigen::VectorXd::Constant(a.size(), 8.0);
  LinearProgram program(-limit, limit);
  program.add_rows(block.normals, block.offsets);
  LinearProgram::Basis basis;
  const LpSolution solution = program.maximise(c / c.norm(), basis);
  if (solution.status != LpSolution::Status::optimal) {
    return outer;
  }
  at = block.coordinates.centre + block.coordinates.transform * solution.x;
  std::vector<const HalfSpace*> vertex;
  for (const int i : basis.rows) {
    if (i >= 0) {
      vertex.push_back(&block.facets[static_cast<std::size_t>(i)]);
    }
  }
  std::vector<WeightedRow> binding = refined_multipliers(vertex, direction, true);
  if (binding.empty()) {
    for (std::size_t k = 0; k < solution.rows.size(); ++k) {
      const int i = solution.rows[k];
      binding.push_back({block.facets[static_cast<std::size_t>(i)],
                         solution.multipliers[static_cast<Eigen::Index>(k)] * c.norm() / block.norms[i]});
    }
  }
  return std::min(outer, certified_upper_bound(direction, binding, within));
}

}  // namespace

double support_of_vertices(const Polytope::Block& block, const Box& hull, std::span<const double> a) noexcept {
  if (block.vertices) {
    const auto q = static_cast<Eigen::Index>(block.parameters.size());
    const Eigen::MatrixXd& points = block.vertices->points;
    double best = -std::numeric_limits<double>::infinity(), margin = 0.0;
    for (Eigen::Index v = 0; v < points.cols(); ++v) {
      double value = 0.0;
      for (Eigen::Index k = 0; k < q; ++k) {
        value += a[block.parameters[static_cast<std::size_t>(k)]] * points(k, v);
      }
      best = std::max(best, value);
    }
    for (Eigen::Index k = 0; k < q; ++k) {
      margin += std::abs(a[block.parameters[static_cast<std::size_t>(k)]]) * block.margin[k];
    }
    return margin == 0.0 ? 0.0 : core::round_up(best + core::round_up(margin * (1.0 + 64.0 * core::kEpsilon)));
  }
  double sum = 0.0;
  for (const std::size_t j : block.parameters) {
    if (a[j] != 0.0) {
      sum = core::round_up(sum + core::round_up(a[j] * (a[j] > 0.0 ? hull.sides[j].upper : hull.sides[j].lower)));
    }
  }
  return sum;
}

std::vector<std::vector<std::size_t>> independent_blocks(std::span<const HalfSpace> rows, std::size_t p) {
  std::vector<std::size_t> leader(p);
  std::iota(leader.begin(), leader.end(), std::size_t{0});
  const auto find = [&](std::size_t j) {
    while (leader[j] != j) {
      j = leader[j];
    }
    return j;
  };
  for (const HalfSpace& row : rows) {
    std::size_t first = p;
    for (std::size_t j = 0; j < p; ++j) {
      if (row.a[static_cast<Eigen::Index>(j)] != 0.0) {
        first = first == p ? find(j) : first;
        const std::size_t x = find(first), y = find(j);
        leader[std::max(x, y)] = std::min(x, y);
      }
    }
  }
  std::vector<std::vector<std::size_t>> groups(p);
  for (std::size_t j = 0; j < p; ++j) {
    groups[find(j)].push_back(j);
  }
  std::erase_if(groups, [](const auto& group) { return group.empty(); });
  return groups;
}

Polytope::Polytope(const std::vector<HalfSpace>& rows, const Box& box, const PolytopeOptions& options) {
  auto result = intersect(rows, box, options);
  check::that(std::holds_alternative<Polytope>(result), "polytope", "a set that is not empty");
  *this = std::move(std::get<Polytope>(result));
}

std::variant<Polytope, std::vector<WeightedRow>> Polytope::intersect(const std::vector<HalfSpace>& rows, const Box& box,
                                                                     const PolytopeOptions& options) {
  const std::size_t p = box.dimension();
  check_finite(box, "box of a polytope");
  for (const HalfSpace& row : rows) {
    check::that(row.a.size() == static_cast<Eigen::Index>(p), "rows of a polytope", "as many coefficients as sides");
    check::that(row.a.allFinite() && std::isfinite(row.b), "rows of a polytope", "finite numbers");
    if (row.a.isZero(0.0) && row.b < 0.0) {
      return std::vector<WeightedRow>{{row, 1.0}};
    }
  }
  auto data = std::make_shared<Data>();
  data->hull.sides.resize(p);
  data->lower.resize(p);
  data->upper.resize(p);
  data->centre.resize(p);
  for (const std::vector<std::size_t>& parameters : independent_blocks(rows, p)) {
    const auto q = static_cast<Eigen::Index>(parameters.size());
    Box part;
    for (const std::size_t j : parameters) {
      part.sides.push_back(box.sides[j]);
    }
    RowBank own;
    own.parameters = parameters.size();
    Eigen::MatrixXd information = Eigen::MatrixXd::Zero(q, q);
    const Eigen::VectorXd farthest = part.magnitudes();
    for (const HalfSpace& row : rows) {
      if (row.a[static_cast<Eigen::Index>(parameters.front())] != 0.0 || !pick(row.a, parameters).isZero(0.0)) {
        const Eigen::VectorXd a = pick(row.a, parameters);
        own.add({a.data(), parameters.size()}, row.b, row.origin);
        // A row that the sign of every parameter decides says nothing of the size of the set.
        const double reach = part.support({a.data(), parameters.size()});
        if (reach > 1e-12 * a.cwiseAbs().dot(farthest)) {
          information += (a / reach) * (a / reach).transpose();
        }
      }
    }
    CuttingPlanes planes(part, information, parameters);
    planes.add(own);
    planes.reduce();
    if (planes.is_empty()) {
      std::vector<WeightedRow> contradiction = planes.contradiction();
      for (WeightedRow& weighted : contradiction) {
        weighted.row = spread(weighted.row, parameters, p);
      }
      return contradiction;
    }
    auto [lower, upper] = planes.certified_hull();

    Block block;
    block.parameters = parameters;
    block.facets = planes.rows();
    block.coordinates = planes.coordinates();
    load(block);
    block.vertices = enumerate_vertices(block.facets, block.coordinates, options.vertex_limit);
    Eigen::VectorXd half(q), middle(q);
    for (Eigen::Index k = 0; k < q; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const std::size_t j = parameters[i];
      data->hull.sides[j] = {std::min(lower[i].value, upper[i].value), std::max(lower[i].value, upper[i].value)};
      half[k] = 0.5 * data->hull.sides[j].width();
      middle[k] = data->hull.sides[j].centre();
      data->lower[j] = spread(std::move(lower[i]), parameters, p);
      data->upper[j] = spread(std::move(upper[i]), parameters, p);
    }
    find_chebyshev_centre(block, half, middle);
    for (Eigen::Index k = 0; k < q; ++k) {
      data->centre[parameters[static_cast<std::size_t>(k)]] = block.chebyshev_centre[k];
    }
    if (block.vertices) {
      // The radius of the points, and the rounding of a p-term product with any of them.
      const double gamma = 8.0 * static_cast<double>(p + 4) * core::kEpsilon;
      block.margin = block.vertices->radius * (1.0 + gamma) +
                     gamma * block.vertices->points.cwiseAbs().rowwise().maxCoeff() +
                     Eigen::VectorXd::Constant(q, std::numeric_limits<double>::min());
      data->looseness = std::max(data->looseness, block.vertices->looseness);
      data->vertex_count += static_cast<std::size_t>(block.vertices->points.cols());
    } else {
      data->has_vertices = false;
    }
    for (const HalfSpace& facet : block.facets) {
      data->facets.push_back(spread(facet, parameters, p));
    }
    data->blocks.push_back(std::move(block));
  }
  if (!data->has_vertices) {
    data->vertex_count = 0;
  }
  return Polytope(std::shared_ptr<const Data>(std::move(data)));
}

double Polytope::support(std::span<const double> a) const noexcept { return support(a, std::span<double>{}); }

double Polytope::support(std::span<const double> a, std::span<double> maximiser) const noexcept {
  double total = 0.0;
  for (const Block& block : data_->blocks) {
    const auto q = static_cast<Eigen::Index>(block.parameters.size());
    Eigen::VectorXd direction(q);
    Box within;
    for (Eigen::Index k = 0; k < q; ++k) {
      const std::size_t j = block.parameters[static_cast<std::size_t>(k)];
      direction[k] = a[j];
      within.sides.push_back(data_->hull.sides[j]);
    }
    Eigen::VectorXd at;
    const double bound = certified_support(block, direction, within, at);
    for (Eigen::Index k = 0; k < q && !maximiser.empty(); ++k) {
      maximiser[block.parameters[static_cast<std::size_t>(k)]] = at[k];
    }
    total = bound == 0.0 ? total : core::round_up(total + bound);
  }
  return std::min(total, data_->hull.support(a));
}

bool Polytope::contains(std::span<const double> theta) const noexcept {
  const Eigen::Map<const Eigen::VectorXd> point(theta.data(), static_cast<Eigen::Index>(theta.size()));
  const double gamma = 4.0 * (static_cast<double>(theta.size()) + 2.0) * core::kEpsilon;
  return std::all_of(data_->facets.begin(), data_->facets.end(), [&](const HalfSpace& row) {
    double sum = 0.0, magnitude = std::abs(row.b);
    for (Eigen::Index j = 0; j < point.size(); ++j) {
      sum += row.a[j] * point[j];
      magnitude += std::abs(row.a[j] * point[j]);
    }
    return sum <= row.b + gamma * magnitude;
  });
}

}  // namespace wheelwright::bounds

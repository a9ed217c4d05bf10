// SPDX-License-Identifier: Apache-2.0
#include "bounds/support_walk.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "bounds/known_size.hpp"
#include "bounds/linear_program.hpp"
#include "core/limits.hpp"

namespace wheelwright::bounds {
namespace {

constexpr double kTight = 1e-13;         // share of the size of h that negative multipliers may cost
constexpr double kWalkPivot = 1e-10;     // smallest pivot
constexpr double kLooseVertices = 1e-9;  // of vertices that are looked through
constexpr double kApart = 1e-13;         // facets are moved outward by up to this where edges are followed
constexpr double kAsNew = 8.0;           // times rounding: an inverse that needs no refinement
constexpr std::uint32_t kNone = 0xffffffff;
constexpr std::uint32_t kFull = kNone - 1;

/// Twice the bound on the relative rounding of a sum of q products and a few terms more (Higham 2002, section 3.1).
double rounding(std::size_t q) { return static_cast<double>(q + 6) * core::kEpsilon; }

std::size_t numbers(std::size_t q) { return 2 * q * q + 5 * q; }

/// A number in [0, 1) that depends on i only.
double scatter(std::uint64_t i) {
  i = (i + 1) * 0x9e3779b97f4a7c15U;
  i = (i ^ (i >> 30)) * 0xbf58476d1ce4e5b9U;
  return static_cast<double>((i ^ (i >> 27)) >> 11) * 0x1.0p-53;
}

std::size_t hash(const std::int32_t* basis, std::size_t q) {
  std::uint64_t h = 0;
  for (std::size_t i = 0; i < q; ++i) {
    h = (h ^ static_cast<std::uint64_t>(basis[i])) * 0x9e3779b97f4a7c15U;
    h ^= h >> 29;
  }
  return h;
}

}  // namespace

/// Parts of a vertex' numbers.
struct SupportWalk::Vertex {
  double* inverse;   // q × q: column r is the edge, in z, along which only facet r is left
  double* place;     // q: z
  double* multiply;  // q × q by columns: μ = M a
  double* point;     // q: v
  double* doubt;     // q: ε
  double* penalty;   // q: of negative μ
  double* weight;    // q: steepness of the edges
};

SupportWalk::Vertex SupportWalk::parts(double* first, std::size_t q) noexcept {
  return {first,
          first + q * q,
          first + q * q + q,
          first + 2 * q * q + q,
          first + 2 * q * q + 2 * q,
          first + 2 * q * q + 3 * q,
          first + 2 * q * q + 4 * q};
}

SupportWalk::SupportWalk(Polytope set, const SupportWalkOptions& options) : set_(std::move(set)), options_(options) {
  check::that(options.slots > 0 && options.vertices >= 2, "support walk", "at least one slot and two vertices");
  for (const Polytope::Block& block : set_.blocks()) {
    Walk walk;
    walk.q = block.parameters.size();
    walk.parameters = block.parameters;
    const bool few = block.vertices && static_cast<std::size_t>(block.vertices->points.cols()) <= options.few &&
                     block.vertices->looseness <= kLooseVertices;
    walk.walked = !few && begin(walk, block, options);
    walks_.push_back(std::move(walk));
  }
}

bool SupportWalk::begin(Walk& walk, const Polytope::Block& block, const SupportWalkOptions& options) {
  const std::size_t q = walk.q, m = block.facets.size();
  const auto n = static_cast<Eigen::Index>(q);
  const Coordinates& at = block.coordinates;
  walk.facets = m;
  walk.stride = (m + kernels::kLanes - 1) / kernels::kLanes * kernels::kLanes;
  walk.normals.assign(walk.stride * q, 0.0);
  walk.offsets.assign(walk.stride, std::numeric_limits<double>::infinity());
  walk.rows.resize(m * q);
  walk.bounds.resize(m);
  walk.penalties.resize(m);
  walk.scale.resize(m);
  walk.transform.assign(at.transform.data(), at.transform.data() + n * n);
  for (std::size_t k = 0; k < q; ++k) {
    const Interval& side = set_.hull().sides[walk.parameters[k]];
    const double c = at.centre[static_cast<Eigen::Index>(k)];
    walk.centre.push_back(c);
    walk.half.push_back(std::max({core::round_up(side.upper - c), core::round_up(c - side.lower), 0.0}));
  }
  Eigen::MatrixXd normals(n, static_cast<Eigen::Index>(m));
  Eigen::VectorXd offsets(static_cast<Eigen::Index>(m));
  const double gamma = rounding(q);
  for (std::size_t i = 0; i < m; ++i) {
    const HalfSpace& facet = block.facets[i];
    const Eigen::VectorXd g = at.transform.transpose() * facet.a;
    walk.scale[i] = std::max(g.norm(), 1e-300);
    const double offset = (facet.b - facet.a.dot(at.centre)) / walk.scale[i];
    normals.col(static_cast<Eigen::Index>(i)) = g / walk.scale[i];
    offsets[static_cast<Eigen::Index>(i)] = offset;
    walk.offsets[i] = offset + kApart * (0.5 + scatter(i));
    double slack = facet.b, magnitude = std::abs(facet.b), reach = 0.0;
    for (std::size_t j = 0; j < q; ++j) {
      const double a = facet.a[static_cast<Eigen::Index>(j)];
      walk.normals[j * walk.stride + i] = g[static_cast<Eigen::Index>(j)] / walk.scale[i];
      walk.rows[i * q + j] = a;
      slack -= a * walk.centre[j];
      magnitude += std::abs(a * walk.centre[j]);
      reach += std::abs(a) * walk.half[j];
    }
    walk.bounds[i] = slack + gamma * magnitude + core::kTiny;
    walk.penalties[i] = (walk.bounds[i] + reach) * (1.0 + gamma) + gamma * magnitude + core::kTiny;
  }
  walk.size = numbers(q);
  walk.room = options.vertices;
  walk.numbers.resize(walk.room * walk.size);
  walk.bases.resize(walk.room * q);
  walk.neighbours.resize(walk.room * q);
  std::size_t slots = 4;
  while (slots < 2 * walk.room) {
    slots *= 2;
  }
  walk.table.assign(slots, kNone);
  walk.slack.resize(walk.stride);
  walk.along.resize(walk.stride);
  walk.scratch.resize(3 * q * q + 2 * q);
  walk.mu.resize(q);
  walk.a.resize(q);
  walk.direction.resize(q);
  walk.sorted.resize(q);
  walk.wanted.resize(q);

  const Eigen::VectorXd limit = Eigen::VectorXd::Constant(n, 8.0);
  LinearProgram program(-limit, limit);
  program.add_rows(normals, offsets);
  LinearProgram::Basis basis;
  if (program.maximise(Eigen::VectorXd::Ones(n), basis).status != LpSolution::Status::optimal ||
      std::any_of(basis.rows.begin(), basis.rows.end(), [](int row) { return row < 0; })) {
    return false;
  }
  walk.places.assign(options.slots, {0, 0, {basis.rows.begin(), basis.rows.end()}});
  return make(walk, walk.places.front().basis.data(), nullptr);
}

/// The vertex of `basis` if it is remembered, else kNone.
std::uint32_t SupportWalk::find(Walk& walk, const std::int32_t* basis) noexcept {
  const std::size_t q = walk.q, mask = walk.table.size() - 1;
  std::copy(basis, basis + q, walk.sorted.begin());
  std::sort(walk.sorted.begin(), walk.sorted.end());
  for (std::size_t h = hash(walk.sorted.data(), q) & mask;; h = (h + 1) & mask) {
    const std::uint32_t v = walk.table[h];
    if (v == kNone) {
      return kNone;
    }
    // Bases are remembered as they are; two are the same vertex when they hold the same facets.
    const std::int32_t* other = walk.bases.data() + v * q;
    if (std::all_of(other, other + q, [&](std::int32_t facet) {
          return std::binary_search(walk.sorted.begin(), walk.sorted.end(), facet);
        })) {
      return v;
    }
  }
}

/// Newton: Z ← Z + Z (I − A Z), with Z by columns; `rest` and `refined` have room for q × q.
void SupportWalk::refine(const Vertex& v, std::size_t q, const double* facets, double* rest, double* refined) noexcept {
  for (std::size_t c = 0; c < q; ++c) {
    for (std::size_t r = 0; r < q; ++r) {
      double sum = r == c ? 1.0 : 0.0;
      for (std::size_t j = 0; j < q; ++j) {
        sum -= facets[r * q + j] * v.inverse[c * q + j];
      }
      rest[c * q + r] = sum;
    }
  }
  std::copy(v.inverse, v.inverse + q * q, refined);
  for (std::size_t c = 0; c < q; ++c) {
    for (std::size_t r = 0; r < q; ++r) {
      const double factor = rest[c * q + r];
      for (std::size_t j = 0; j < q; ++j) {
        refined[c * q + j] += factor * v.inverse[r * q + j];
      }
    }
  }
  std::copy(refined, refined + q * q, v.inverse);
}

/// All that follows from the inverse: M, v, ε, …. How many times larger I − AᵀM is than rounding alone would make it;
/// not finite where anything is not.
template <std::size_t Q>
double SupportWalk::enclose(Walk& walk, const Vertex& v, const std::int32_t* basis) noexcept {
  const std::size_t q = Q > 0 ? Q : walk.q;
  const double gamma = rounding(q);
  double held_sum[Q > 0 ? Q : 1], held_size[Q > 0 ? Q : 1];
  double* const sum = Q > 0 ? held_sum : walk.mu.data();
  double* const size = Q > 0 ? held_size : walk.direction.data();
  std::fill(v.place, v.place + q, 0.0);
  for (std::size_t r = 0; r < q; ++r) {
    const auto facet = static_cast<std::size_t>(basis[r]);
    const double* edge = v.inverse + r * q;
    double norm = 0.0;
    for (std::size_t j = 0; j < q; ++j) {
      v.place[j] += edge[j] * walk.offsets[facet];
      norm += edge[j] * edge[j];
    }
    v.weight[r] = walk.scale[facet] / std::sqrt(norm);
    v.penalty[r] = walk.penalties[facet];
    std::fill(sum, sum + q, 0.0);
    for (std::size_t k = 0; k < q; ++k) {
      for (std::size_t j = 0; j < q; ++j) {
        sum[j] += walk.transform[k * q + j] * edge[k];
      }
    }
    for (std::size_t j = 0; j < q; ++j) {
      v.multiply[j * q + r] = sum[j] / walk.scale[facet];
    }
  }
  double worse = 0.0;
  for (std::size_t k = 0; k < q; ++k) {
    const double* column = v.multiply + k * q;  // μ per unit of a_k
    double point = walk.centre[k], sizes = std::abs(walk.centre[k]), negative = 0.0;
    std::fill(sum, sum + q, 0.0);
    std::fill(size, size + q, 0.0);
    sum[k] = size[k] = 1.0;
    for (std::size_t r = 0; r < q; ++r) {
      const auto facet = static_cast<std::size_t>(basis[r]);
      const double term = column[r] * walk.bounds[facet];
      point += term;
      sizes += std::abs(term);
      negative += std::abs(column[r]) * v.penalty[r];
      const double* row = walk.rows.data() + facet * q;
      for (std::size_t j = 0; j < q; ++j) {
        sum[j] -= row[j] * column[r];
        size[j] += std::abs(row[j] * column[r]);
      }
    }
    double left = 0.0, floor = 0.0;
    for (std::size_t j = 0; j < q; ++j) {
      left += std::abs(sum[j]) * walk.half[j];
      floor += gamma * size[j] * walk.half[j];
    }
    v.point[k] = point;
    v.doubt[k] = (left + floor + gamma * (2.0 * sizes + std::abs(point) + negative)) * (1.0 + gamma) + core::kTiny;
    const double ratio = left / std::max(floor, core::kTiny);
    worse = ratio <= worse ? worse : ratio;
    worse = std::isfinite(v.doubt[k]) && std::isfinite(point) ? worse : std::numeric_limits<double>::quiet_NaN();
  }
  return worse;
}

/// Remembers the vertex of `basis` as the newest; `inverse` is nearly that of its facets, or null. False where the
/// facets do not meet in a point.
bool SupportWalk::make(Walk& walk, const std::int32_t* basis, const double* inverse) noexcept {
  const std::size_t q = walk.q;
  const Vertex v = parts(walk.numbers.data() + walk.vertices * walk.size, q);
  double* facets = walk.scratch.data();  // q × q, row after row: normals of the basis in z
  double* rest = walk.scratch.data() + q * q;
  for (std::size_t r = 0; r < q; ++r) {
    for (std::size_t j = 0; j < q; ++j) {
      facets[r * q + j] = walk.normals[j * walk.stride + static_cast<std::size_t>(basis[r])];
    }
  }
  if (inverse != nullptr) {
    std::copy(inverse, inverse + q * q, v.inverse);
  } else {
    // Gauss and Jordan with the largest pivot of each column.
    std::copy(facets, facets + q * q, rest);
    std::fill(v.inverse, v.inverse + q * q, 0.0);
    for (std::size_t r = 0; r < q; ++r) {
      v.inverse[r * q + r] = 1.0;  // for now: row after row, the identity
    }
    for (std::size_t c = 0; c < q; ++c) {
      std::size_t best = c;
      for (std::size_t r = c + 1; r < q; ++r) {
        best = std::abs(rest[r * q + c]) > std::abs(rest[best * q + c]) ? r : best;
      }
      if (!(std::abs(rest[best * q + c]) > 1e-13)) {
        return false;
      }
      for (std::size_t j = 0; j < q; ++j) {
        std::swap(rest[c * q + j], rest[best * q + j]);
        std::swap(v.inverse[c * q + j], v.inverse[best * q + j]);
      }
      const double pivot = 1.0 / rest[c * q + c];
      for (std::size_t j = 0; j < q; ++j) {
        rest[c * q + j] *= pivot;
        v.inverse[c * q + j] *= pivot;
      }
      for (std::size_t r = 0; r < q; ++r) {
        const double factor = rest[r * q + c];
        if (r != c && factor != 0.0) {
          for (std::size_t j = 0; j < q; ++j) {
            rest[r * q + j] -= factor * rest[c * q + j];
            v.inverse[r * q + j] -= factor * v.inverse[c * q + j];
          }
        }
      }
    }
    for (std::size_t r = 0; r < q; ++r) {
      for (std::size_t j = r + 1; j < q; ++j) {
        std::swap(v.inverse[r * q + j], v.inverse[j * q + r]);
      }
    }
  }
  // A neighbour's inverse with one facet exchanged is nearly always as good as a fresh one; where it is not, it is
  // refined once.
  const auto enclosed = [&] {
    return with_known_size(q, [&](auto known) { return enclose<known()>(walk, v, basis); });
  };
  double worse = enclosed();
  if (!(worse <= kAsNew)) {
    refine(v, q, facets, rest, walk.scratch.data() + 2 * q * q);
    worse = enclosed();
  }
  const bool finite = std::isfinite(worse);
  if (!finite) {
    return false;
  }
  std::copy(basis, basis + q, walk.bases.begin() + static_cast<std::ptrdiff_t>(walk.vertices * q));
  std::fill_n(walk.neighbours.begin() + static_cast<std::ptrdiff_t>(walk.vertices * q), q, -1);
  std::copy(basis, basis + q, walk.sorted.begin());
  std::sort(walk.sorted.begin(), walk.sorted.end());
  const std::size_t mask = walk.table.size() - 1;
  std::size_t h = hash(walk.sorted.data(), q) & mask;
  while (walk.table[h] != kNone) {
    h = (h + 1) & mask;
  }
  walk.table[h] = static_cast<std::uint32_t>(walk.vertices++);
  return true;
}

/// The vertex at the other end of the edge along which facet `leaving` of vertex `from` is left; kNone where the edge
/// finds no end, kFull where there is no room to remember it.
std::uint32_t SupportWalk::step(Walk& walk, std::uint32_t from, std::size_t leaving) noexcept {
  const std::size_t q = walk.q;
  const std::int32_t known = walk.neighbours[from * q + leaving];
  if (known >= 0) {
    return static_cast<std::uint32_t>(known);
  }
  ++count_.ratio_tests;
  const Vertex v = parts(walk.numbers.data() + from * walk.size, q);
  for (std::size_t j = 0; j < q; ++j) {
    walk.direction[j] = -v.inverse[leaving * q + j];
  }
  const kernels::Rows rows{walk.normals.data(), walk.stride, walk.stride, q, walk.offsets.data()};
  const kernels::Table& loops = kernels::best();
  loops.slack(rows, v.place, walk.slack.data());
  const std::int32_t* basis = walk.bases.data() + from * q;
  for (std::size_t r = 0; r < q; ++r) {
    walk.slack[static_cast<std::size_t>(basis[r])] = std::numeric_limits<double>::infinity();
  }
  const kernels::Found end =
      loops.first_blocking(rows, walk.slack.data(), walk.direction.data(), kWalkPivot, walk.along.data());
  if (!(end.value < std::numeric_limits<double>::infinity())) {
    return kNone;
  }
  std::int32_t* wanted = walk.wanted.data();
  std::copy(basis, basis + q, wanted);
  wanted[leaving] = static_cast<std::int32_t>(end.row);
  std::uint32_t to = find(walk, wanted);
  if (to == kNone) {
    if (walk.vertices == walk.room) {
      return kFull;
    }
    // The inverse of the neighbour: one facet exchanged.
    double* inverse = walk.scratch.data() + 2 * q * q;
    std::copy(v.inverse, v.inverse + q * q, inverse);
    double pivot = 0.0;
    for (std::size_t j = 0; j < q; ++j) {
      pivot += walk.normals[j * walk.stride + end.row] * v.inverse[leaving * q + j];
    }
    for (std::size_t j = 0; j < q; ++j) {
      inverse[leaving * q + j] /= pivot;
    }
    for (std::size_t r = 0; r < q; ++r) {
      if (r != leaving) {
        double share = 0.0;
        for (std::size_t j = 0; j < q; ++j) {
          share += walk.normals[j * walk.stride + end.row] * v.inverse[r * q + j];
        }
        for (std::size_t j = 0; j < q; ++j) {
          inverse[r * q + j] -= share * inverse[leaving * q + j];
        }
      }
    }
    if (!make(walk, wanted, inverse)) {
      return kNone;
    }
    to = static_cast<std::uint32_t>(walk.vertices - 1);
    walk.neighbours[to * q + leaving] = static_cast<std::int32_t>(from);
  }
  walk.neighbours[from * q + leaving] = static_cast<std::int32_t>(to);
  return to;
}

/// Forgets all vertices but the one of `basis`, which becomes vertex 0.
bool SupportWalk::forget(Walk& walk, const std::int32_t* basis) noexcept {
  std::copy(basis, basis + walk.q, walk.wanted.begin());
  std::fill(walk.table.begin(), walk.table.end(), kNone);
  walk.vertices = 0;
  ++walk.generation;
  return make(walk, walk.wanted.data(), nullptr);
}

template <std::size_t Q>
double SupportWalk::follow(Walk& walk, Place& place, double size) noexcept {
  const std::size_t q = Q > 0 ? Q : walk.q;
  const double* a = walk.a.data();
  double held_mu[Q > 0 ? Q : 1];
  double* const mu = Q > 0 ? held_mu : walk.mu.data();
  if (place.generation != walk.generation) {
    place.vertex = find(walk, place.basis.data());
    if (place.vertex == kNone) {
      if (walk.vertices == walk.room ? !forget(walk, place.basis.data()) : !make(walk, place.basis.data(), nullptr)) {
        ++count_.cut_short;
        return std::numeric_limits<double>::infinity();
      }
      place.vertex = static_cast<std::uint32_t>(walk.vertices - 1);
    }
    place.generation = walk.generation;
  }
  std::uint32_t at = place.vertex;
  double cost = 0.0;
  for (std::size_t edges = 0;; ++edges) {
    const Vertex v = parts(walk.numbers.data() + at * walk.size, q);
    for (std::size_t r = 0; r < q; ++r) {
      mu[r] = v.multiply[r] * a[0];
    }
    for (std::size_t k = 1; k < q; ++k) {
      const double* column = v.multiply + k * q;
      for (std::size_t r = 0; r < q; ++r) {
        mu[r] += column[r] * a[k];
      }
    }
    cost = 0.0;
    double steepest = 0.0;
    std::size_t leaving = q;
    for (std::size_t r = 0; r < q; ++r) {
      cost += std::max(-mu[r], 0.0) * v.penalty[r];
    }
    if (cost <= kTight * size) {
      break;
    }
    if (edges == options_.budget) {
      ++count_.cut_short;
      break;
    }
    for (std::size_t r = 0; r < q; ++r) {
      if (mu[r] * v.weight[r] < steepest) {
        steepest = mu[r] * v.weight[r];
        leaving = r;
      }
    }
    std::uint32_t next = leaving < q ? step(walk, at, leaving) : kNone;
    if (next == kFull) {
      if (!forget(walk, walk.bases.data() + at * q)) {
        ++count_.cut_short;
        return std::numeric_limits<double>::infinity();
      }
      at = 0;
      next = step(walk, at, leaving);
    }
    if (next == kNone || next == kFull) {
      ++count_.cut_short;
      break;
    }
    ++count_.edges;
    at = next;
  }
  if (at != place.vertex || place.generation != walk.generation) {
    place.vertex = at;
    place.generation = walk.generation;
    std::copy_n(walk.bases.begin() + static_cast<std::ptrdiff_t>(at * q), q, place.basis.begin());
  }
  const Vertex v = parts(walk.numbers.data() + at * walk.size, q);
  double value = 0.0, doubt = 0.0;
  for (std::size_t k = 0; k < q; ++k) {
    value += a[k] * v.point[k];
    doubt += std::abs(a[k]) * v.doubt[k];
  }
  // The last addition rounds by half an epsilon of the result at most.
  return value + ((cost + doubt) * (1.0 + rounding(q)) + (2.0 * core::kEpsilon * std::abs(value) + core::kTiny));
}

std::optional<VertexGraph> SupportWalk::graph(std::size_t block) {
  Walk& walk = walks_[block];
  const std::size_t q = walk.q;
  if (!walk.walked) {
    return std::nullopt;
  }
  for (std::size_t v = 0; v < walk.vertices; ++v) {
    for (std::size_t r = 0; r < q; ++r) {
      const std::uint32_t to = step(walk, static_cast<std::uint32_t>(v), r);
      if (to == kNone || to == kFull) {
        return std::nullopt;
      }
    }
  }
  VertexGraph graph{walk.parameters, walk.half, {}, {}};
  graph.numbers.reserve(walk.vertices * (q * q + 4 * q));
  for (std::size_t v = 0; v < walk.vertices; ++v) {
    const Vertex parts_of = parts(walk.numbers.data() + v * walk.size, q);
    const auto append = [&](const double* first, std::size_t count) {
      graph.numbers.insert(graph.numbers.end(), first, first + count);
    };
    append(parts_of.multiply, q * q);
    for (const double* part : {parts_of.point, parts_of.doubt, parts_of.penalty, parts_of.weight}) {
      append(part, q);
    }
  }
  const auto known = static_cast<std::ptrdiff_t>(walk.vertices * q);
  graph.neighbours.assign(walk.neighbours.begin(), walk.neighbours.begin() + known);
  return graph;
}

double SupportWalk::support(std::span<const double> a, std::size_t slot) noexcept {
  double total = 0.0;
  for (std::size_t i = 0; i < walks_.size(); ++i) {
    Walk& walk = walks_[i];
    double bound = 0.0;
    if (walk.walked) {
      double size = 0.0;
      for (std::size_t k = 0; k < walk.q; ++k) {
        walk.a[k] = a[walk.parameters[k]];
        size += std::abs(walk.a[k]) * walk.half[k];
      }
      if (size == 0.0 && std::all_of(walk.a.begin(), walk.a.end(), [](double x) { return x == 0.0; })) {
        continue;
      }
      ++count_.directions;
      bound = with_known_size(walk.q, [&](auto known) { return follow<known()>(walk, walk.places[slot], size); });
    } else {
      bound = support_of_vertices(set_.blocks()[i], set_.hull(), a);
    }
    total = i == 0 || total == 0.0 ? bound : core::round_up(total + bound);
  }
  return std::min(total, set_.hull().support(a));
}

}  // namespace wheelwright::bounds

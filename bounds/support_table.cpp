// SPDX-License-Identifier: Apache-2.0
#include "bounds/support_table.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "bounds/known_size.hpp"
#include "core/limits.hpp"

namespace wheelwright::bounds {

std::optional<SupportTable> SupportTable::make(const Polytope& set, const SupportTableOptions& options) {
  check::that(options.slots > 0 && options.vertices >= 2, "support table", "at least one slot and two vertices");
  SupportTable table(set, options);
  std::vector<VertexGraph> graphs;
  std::size_t largest = 0;
  std::optional<SupportWalk> walk;
  for (std::size_t b = 0; b < set.blocks().size(); ++b) {
    const Polytope::Block& block = set.blocks()[b];
    if (block.parameters.size() == 1) {
      table.singles_.push_back(block.parameters.front());
      continue;
    }
    // Vertices that are listed already say in advance whether there is room.
    if (block.vertices && static_cast<std::size_t>(block.vertices->points.cols()) > options.vertices) {
      return std::nullopt;
    }
    if (!walk) {
      walk.emplace(set, SupportWalkOptions{.slots = 1, .vertices = options.vertices, .few = 0});
    }
    std::optional<VertexGraph> graph = walk->graph(b);
    if (!graph) {
      return std::nullopt;
    }
    largest = std::max(largest, block.parameters.size());
    graphs.push_back(*std::move(graph));
  }
  table.places_.assign(graphs.size() * options.slots, 0);
  table.graphs_ = std::make_shared<const std::vector<VertexGraph>>(std::move(graphs));
  table.a_.resize(largest);
  table.mu_.resize(largest);
  return table;
}

namespace {

// What blocks have added to h so far.
struct Sum {
  double value = 0.0, magnitude = 0.0, slack = 0.0;
  std::size_t edges = 0;
};

// From the vertex at `place` along edges to the best one for `direction`, at most `budget` of them. Q is the block's
// number of parameters, or 0 where that is known to `graph` alone: then `room_a` and `room_mu` have room for it.
template <std::size_t Q>
void follow(const VertexGraph& graph, const double* direction, std::uint32_t& place, std::size_t budget, double* room_a,
            double* room_mu, Sum& h) {
  const std::size_t q = Q > 0 ? Q : graph.parameters.size(), stride = q * q + 4 * q;
  double held_a[Q > 0 ? Q : 1], held_mu[Q > 0 ? Q : 1];
  double* const a = Q > 0 ? held_a : room_a;
  double* const mu = Q > 0 ? held_mu : room_mu;
  double size = 0.0, sum = 0.0, product = 0.0;
  for (std::size_t k = 0; k < q; ++k) {
    a[k] = direction[graph.parameters[k]];
    sum += std::abs(a[k]);
    size += std::abs(a[k]) * graph.half[k];
  }
  if (sum == 0.0) {
    return;
  }
  const double* multiply = nullptr;
  for (std::size_t left = budget;; --left) {
    multiply = graph.numbers.data() + place * stride;
    const double* penalty = multiply + q * q + 2 * q;
    const double* weight = penalty + q;
    double cost = 0.0, steepest = 0.0;
    std::size_t leaving = 0;
    for (std::size_t r = 0; r < q; ++r) {
      mu[r] = multiply[r] * a[0];
    }
    for (std::size_t k = 1; k < q; ++k) {
      for (std::size_t r = 0; r < q; ++r) {
        mu[r] += multiply[k * q + r] * a[k];
      }
    }
    for (std::size_t r = 0; r < q; ++r) {
      if (mu[r] < 0.0) {
        cost -= mu[r] * penalty[r];
        if (mu[r] * weight[r] < steepest) {
          steepest = mu[r] * weight[r];
          leaving = r;
        }
      }
    }
    if (cost <= SupportTable::kTight * size || left == 0) {
      h.slack += cost;
      break;
    }
    place = graph.neighbours[place * q + leaving];
    ++h.edges;
  }
  const double* point = multiply + q * q;
  const double* doubt = point + q;
  for (std::size_t k = 0; k < q; ++k) {
    product += a[k] * point[k];
    h.slack += std::abs(a[k]) * doubt[k];
  }
  h.value += product;
  h.magnitude += std::abs(product);
}

}  // namespace

double SupportTable::support(std::span<const double> a, std::size_t slot) noexcept {
  Sum h;
  for (const std::size_t j : singles_) {
    const Interval& side = set_.hull().sides[j];
    const double product = a[j] * (a[j] > 0.0 ? side.upper : side.lower);
    h.value += product;
    h.magnitude += std::abs(product);
  }
  for (std::size_t g = 0; g < graphs_->size(); ++g) {
    std::uint32_t& place = places_[g * options_.slots + slot];
    const VertexGraph& graph = (*graphs_)[g];
    with_known_size(graph.parameters.size(), [&](auto known) {
      follow<known()>(graph, a.data(), place, options_.budget, a_.data(), mu_.data(), h);
    });
  }
  edges_ += h.edges;
  // ε covers the rounding of μ and of a·v. What is left: sums of at most p numbers >= 0 (slack), and of at most p
  // products of either sign with the last addition (Higham 2002, section 3.1); twice of each covers the bound's own
  // rounding.
  const double p = static_cast<double>(a.size());
  const double bound = h.value + (h.slack * (1.0 + (p + 6.0) * core::kEpsilon) +
                                  ((p + 2.0) * core::kEpsilon * h.magnitude + core::kTiny));
  return std::min(bound, set_.hull().support(a));
}

}  // namespace wheelwright::bounds

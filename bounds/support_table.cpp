// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/support_table.hpp>
#include <wheelwright/core/limits.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace wheelwright::bounds {

std::optional<SupportTable> SupportTable::make(const Polytope& set, const SupportTableOptions& options) {
  check::that(options.slots > 0 && options.vertices >= 2, "support table", "at least one slot and two vertices");
  SupportTable table(set, options);
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
    table.graphs_.push_back(*std::move(graph));
  }
  table.places_.assign(table.graphs_.size() * options.slots, 0);
  table.a_.resize(largest);
  table.mu_.resize(largest);
  return table;
}

double SupportTable::support(std::span<const double> a, std::size_t slot) noexcept {
  double value = 0.0, magnitude = 0.0, slack = 0.0;
  for (const std::size_t j : singles_) {
    const Interval& side = set_.hull().sides[j];
    const double product = a[j] * (a[j] > 0.0 ? side.upper : side.lower);
    value += product;
    magnitude += std::abs(product);
  }
  for (std::size_t g = 0; g < graphs_.size(); ++g) {
    const VertexGraph& graph = graphs_[g];
    const std::size_t q = graph.parameters.size(), stride = q * q + 4 * q;
    double size = 0.0, sum = 0.0;
    for (std::size_t k = 0; k < q; ++k) {
      a_[k] = a[graph.parameters[k]];
      sum += std::abs(a_[k]);
      size += std::abs(a_[k]) * graph.half[k];
    }
    if (sum == 0.0) {
      continue;
    }
    std::uint32_t& place = places_[g * options_.slots + slot];
    for (std::size_t left = options_.budget;; --left) {
      const double* multiply = graph.numbers.data() + place * stride;
      const double* penalty = multiply + q * q + 2 * q;
      const double* weight = penalty + q;
      double cost = 0.0, steepest = 0.0;
      std::size_t leaving = 0;
      for (std::size_t r = 0; r < q; ++r) {
        mu_[r] = multiply[r] * a_[0];
      }
      for (std::size_t k = 1; k < q; ++k) {
        for (std::size_t r = 0; r < q; ++r) {
          mu_[r] += multiply[k * q + r] * a_[k];
        }
      }
      for (std::size_t r = 0; r < q; ++r) {
        if (mu_[r] < 0.0) {
          cost -= mu_[r] * penalty[r];
          if (mu_[r] * weight[r] < steepest) {
            steepest = mu_[r] * weight[r];
            leaving = r;
          }
        }
      }
      if (cost <= kTight * size || left == 0) {
        slack += cost;
        break;
      }
      place = graph.neighbours[place * q + leaving];
      ++edges_;
    }
    const double* point = graph.numbers.data() + place * stride + q * q;
    const double* doubt = point + q;
    double product = 0.0;
    for (std::size_t k = 0; k < q; ++k) {
      product += a_[k] * point[k];
      slack += std::abs(a_[k]) * doubt[k];
    }
    value += product;
    magnitude += std::abs(product);
  }
  // ε covers the rounding of μ and of a·v. What is left: sums of at most p numbers >= 0 (slack), and of at most p
  // products of either sign with the last addition (Higham 2002, section 3.1); twice of each covers the bound's own
  // rounding.
  const double p = static_cast<double>(a.size());
  const double bound =
      value + (slack * (1.0 + (p + 6.0) * core::kEpsilon) + ((p + 2.0) * core::kEpsilon * magnitude + core::kTiny));
  return std::min(bound, set_.hull().support(a));
}

}  // namespace wheelwright::bounds

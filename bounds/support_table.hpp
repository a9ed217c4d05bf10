// SPDX-License-Identifier: Apache-2.0
/// \file
/// Support function from a table that is complete before the first query: plain loops, bounded work.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "bounds/polytope.hpp"
#include "bounds/support_walk.hpp"

namespace wheelwright::bounds {

/// Options of SupportTable.
struct SupportTableOptions {
  std::size_t slots = 2;           ///< directions that are followed independently, each from where it was last
  std::size_t budget = 64;         ///< most edges walked for one direction, per block
  std::size_t vertices = 1 << 12;  ///< most vertices of one block
};

/// h(a) = max { a·θ : θ in set } for one direction after the other, as SupportWalk has it, for sets whose vertices are
/// few enough to be listed with all their edges.
///
/// A block of one parameter is its side [l, u] of the hull. In every other block a query starts from the vertex that
/// was best for the last direction of its slot and leaves the facet with the steepest negative multiplier, until the
/// negative ones cost no more than rounding or the budget is used. With the vertices v_b where the blocks' walks end,
///
///     h(a) <= Σ_b a·v_b + Σ_b (Σ_r max(0, −μ_r) penalty_r + Σ_j ε_j |a_j|) + rounding,     μ = M a,
///
/// which is SupportWalk's bound and holds wherever the walk ends: a budget that runs out costs tightness, never the
/// guarantee. A query is a fixed sequence of additions, multiplications and comparisons, without fused multiply-add, so
/// that the same numbers in another language give the same digits. Nothing is allocated after construction. One object
/// serves one thread; its copies share the vertices.
class SupportTable {
 public:
  /// For `set`, whose data are shared. Nothing where a block has more vertices than options.vertices, or its edges
  /// cannot be followed in doubles (a set that is too flat). Throws InvalidArgument unless there is a slot and room for
  /// two vertices.
  [[nodiscard]] static std::optional<SupportTable> make(const Polytope& set, const SupportTableOptions& options = {});

  /// h(a), rounded outward, never above the support of the set's hull; `a` has p finite entries (unchecked), `slot` is
  /// below options.slots.
  [[nodiscard]] double support(std::span<const double> a, std::size_t slot = 0) noexcept;

  [[nodiscard]] const Polytope& set() const noexcept { return set_; }
  [[nodiscard]] const SupportTableOptions& options() const noexcept { return options_; }
  /// Blocks of one parameter, of which the hull says all.
  [[nodiscard]] const std::vector<std::size_t>& singles() const noexcept { return singles_; }
  /// The other blocks.
  [[nodiscard]] const std::vector<VertexGraph>& graphs() const noexcept { return *graphs_; }
  /// Edges that were walked so far.
  [[nodiscard]] std::size_t edges() const noexcept { return edges_; }

  /// Share of Σ|a_j| H_j that negative multipliers may cost where a walk ends.
  static constexpr double kTight = 1e-13;

 private:
  SupportTable(Polytope set, const SupportTableOptions& options) : set_(std::move(set)), options_(options) {}

  Polytope set_;
  SupportTableOptions options_;
  std::vector<std::size_t> singles_;
  std::shared_ptr<const std::vector<VertexGraph>> graphs_;
  std::vector<std::uint32_t> places_;  // graphs × slots
  std::vector<double> a_, mu_;         // room for the largest block
  std::size_t edges_ = 0;
};

}  // namespace wheelwright::bounds

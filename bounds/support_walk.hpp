// SPDX-License-Identifier: Apache-2.0
/// \file
/// Support function along slowly turning directions: from vertex to vertex, certified at every step.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "bounds/polytope.hpp"

namespace wheelwright::bounds {

/// Options of SupportWalk.
struct SupportWalkOptions {
  std::size_t slots = 2;           ///< directions that are followed independently, each from where it was last
  std::size_t budget = 64;         ///< most edges walked for one direction
  std::size_t vertices = 1 << 12;  ///< most vertices remembered, per block; all are forgotten when there is no room
  std::size_t few = 24;            ///< blocks with at most that many known vertices are looked through instead
};

/// Cost of a walk so far.
struct SupportWalkCount {
  std::size_t directions = 0;   ///< support() calls, times blocks that are walked
  std::size_t edges = 0;        ///< edges walked
  std::size_t ratio_tests = 0;  ///< edges that had to be found by a look at all facets
  std::size_t cut_short = 0;    ///< directions whose budget ran out: their bound holds, but may not be tight
};

/// All vertices of one block of a set, and the edges between them: what a walk can ever come to know.
struct VertexGraph {
  std::vector<std::size_t> parameters;  ///< q of them, ascending
  std::vector<double> half;             ///< H, q numbers
  std::vector<double> numbers;  ///< for each vertex M (q × q, by columns), then v, ε, penalties s_i + Σ|A_ij|H_j
                                ///< and the steepness of its edges (q each): q² + 4q
  std::vector<std::uint32_t> neighbours;  ///< for each vertex q: where the edge ends on which its facet r is left

  /// How many vertices there are.
  [[nodiscard]] std::size_t vertices() const noexcept { return neighbours.size() / parameters.size(); }
};

/// Memory that is not touched before it is written: room for many vertices costs nothing until they come.
template <class T>
struct Uninitialised : std::allocator<T> {
  /// The same for another type.
  template <class U>
  struct rebind {
    using other = Uninitialised<U>;
  };
  /// Leaves `place` as it is.
  template <class U>
  void construct(U* place) noexcept {
    static_cast<void>(place);
  }
  /// Makes a value at `place`.
  template <class U, class... Arguments>
  void construct(U* place, Arguments&&... arguments) {
    ::new (static_cast<void*>(place)) U(std::forward<Arguments>(arguments)...);
  }
};

/// h(a) = max { a·θ : θ in set } for one direction after the other.
///
/// A vertex is where q facets A_B θ = b_B meet; it is the best for all directions a with μ = A_B⁻ᵀa >= 0. The walk
/// starts from the vertex that was best for the last direction of the same slot and follows edges; vertices and edges
/// are remembered. Whatever vertex it ends at, with s_i >= b_i − A_i c, |θ_j − c_j| <= H_j on the set, M ≈ A_B⁻ᵀ and v
/// = c + Mᵀs,
///
///     h(a) <= a·v + Σ_i max(0, −μ_i) (s_i + Σ_j |A_ij| H_j) + Σ_j ε_j |a_j|,     μ = M a,
///
/// ε of a vertex enclosing I − A_Bᵀ M over the hull and all rounding. So the bound holds at every step, is the support
/// to rounding where μ >= 0, and the hull's support where that is smaller: a budget that runs out costs tightness,
/// never the guarantee. Nothing is allocated after construction. One object serves one thread.
class SupportWalk {
 public:
  /// For `set`, whose data are shared.
  explicit SupportWalk(Polytope set, const SupportWalkOptions& options = {});

  /// h(a), rounded outward, never above the support of the set's hull; `a` has p finite entries (unchecked), `slot` is
  /// below options.slots.
  [[nodiscard]] double support(std::span<const double> a, std::size_t slot = 0) noexcept;

  /// Follows every edge of the block `block` of the set, breadth first. Nothing where the block has more vertices than
  /// options.vertices, or is not walked (options.few), or an edge has no end. Allocates.
  [[nodiscard]] std::optional<VertexGraph> graph(std::size_t block);

  [[nodiscard]] const Polytope& set() const noexcept { return set_; }
  [[nodiscard]] const SupportWalkCount& count() const noexcept { return count_; }

 private:
  struct Place {
    std::uint32_t vertex = 0;
    std::uint32_t generation = 0;
    std::vector<std::int32_t> basis;
  };
  struct Walk {
    std::size_t q = 0, facets = 0, stride = 0;
    std::vector<std::size_t> parameters;
    bool walked = false;                                 // else the block's hull (or its few vertices) must do
    std::vector<double> normals, offsets;                // in z, by columns, padded: where edges end
    std::vector<double> rows, bounds, penalties;         // in θ: facet × q; s_i; s_i + Σ|A|H
    std::vector<double> scale;                           // norm of a facet in z
    std::vector<double> centre, half, transform;         // θ = centre + transform z (by columns); H
    std::vector<double, Uninitialised<double>> numbers;  // of vertices, `size` each
    std::vector<std::int32_t> bases, neighbours;         // vertices × q
    std::vector<std::uint32_t> table;                    // open hash of bases
    std::size_t size = 0, vertices = 0, room = 0;
    std::uint32_t generation = 0;
    std::vector<Place> places;
    std::vector<double> slack, along, scratch, mu, direction;
    std::vector<double> a;
    std::vector<std::int32_t> sorted, wanted;
  };

  struct Vertex;

  [[nodiscard]] static Vertex parts(double* first, std::size_t q) noexcept;
  static void refine(const Vertex& v, std::size_t q, const double* facets, double* rest, double* refined) noexcept;
  // Q is the block's number of parameters, or 0 where that is known to `walk` alone.
  template <std::size_t Q>
  [[nodiscard]] static double enclose(Walk& walk, const Vertex& v, const std::int32_t* basis) noexcept;
  bool begin(Walk& walk, const Polytope::Block& block, const SupportWalkOptions& options);
  [[nodiscard]] static std::uint32_t find(Walk& walk, const std::int32_t* basis) noexcept;
  [[nodiscard]] static bool make(Walk& walk, const std::int32_t* basis, const double* inverse) noexcept;
  [[nodiscard]] static bool forget(Walk& walk, const std::int32_t* basis) noexcept;
  [[nodiscard]] std::uint32_t step(Walk& walk, std::uint32_t from, std::size_t leaving) noexcept;
  template <std::size_t Q>
  [[nodiscard]] double follow(Walk& walk, Place& place, double size) noexcept;

  Polytope set_;
  SupportWalkOptions options_;
  std::vector<Walk> walks_;
  SupportWalkCount count_;
};

}  // namespace wheelwright::bounds

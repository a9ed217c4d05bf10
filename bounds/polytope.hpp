// SPDX-License-Identifier: Apache-2.0
/// \file
/// Polytopes of parameters: facets, vertices (proved complete), support function, interval hull.
#pragma once

#include <memory>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "bounds/box.hpp"
#include "bounds/certificate.hpp"

namespace wheelwright::bounds {

/// Vertices of a polytope P' that contains P and exceeds it by about `looseness` of P's size.
struct VertexSet {
  Eigen::MatrixXd points;  ///< p × V, one vertex per column
  Eigen::VectorXd radius;  ///< p: each point is within radius_j of an exact vertex of P' in coordinate j
  double looseness = 0.0;  ///< outward shift of the facets, relative to the size of P in `coordinates`
};

/// Enumerates the vertices of P = { θ : a·θ <= b for every row }, bounded and with an interior, at most `limit` of
/// them.
///
/// Facets are shifted outward by a tiny pseudo-random amount, so that exactly p of them meet in each vertex, and are
/// inserted one by one: the vertices that a facet cuts off are replaced by one on every edge that it crosses (Motzkin
/// et al. 1953, in its simple-polytope form). Then the result is proved: every vertex is enclosed (|θ − θ*| <= radius,
/// from an approximate inverse), strictly inside all other facets, and each of its p edges ends in another vertex of
/// the list. The graph of a polytope is connected (Balinski 1961), so a list that is closed under adjacency is complete
/// and P ⊆ P' = conv of the exact vertices.
///
/// Nothing where the limit is passed or no shift up to 1e-6 passes the proof (a set that is too flat for doubles).
/// `coordinates` are such that P has size about one.
[[nodiscard]] std::optional<VertexSet> enumerate_vertices(std::span<const HalfSpace> rows,
                                                          const Coordinates& coordinates, std::size_t limit);

/// Options of Polytope.
struct PolytopeOptions {
  std::size_t vertex_limit = 4096;  ///< most vertices per independent block; beyond it the support function is an LP
};

/// Groups of parameters that no row couples, each ascending, ordered by their first member: the sets are then a
/// product. Parameters in no row form groups of their own.
[[nodiscard]] std::vector<std::vector<std::size_t>> independent_blocks(std::span<const HalfSpace> rows, std::size_t p);

/// { θ in box : a·θ <= b for every row }: bounded by its box; held as the product of its independent blocks.
///
/// Everything it publishes as a bound (support, hull) is rounded outward: never inside the exact value. Copies share
/// their data; a Polytope is immutable and may be read from several threads.
class Polytope {
 public:
  /// A set of independent parameters and all that is known of it.
  struct Block {
    std::vector<std::size_t> parameters;  ///< ascending
    std::vector<HalfSpace> facets;        ///< non-redundant, in these parameters only
    Coordinates coordinates;              ///< the block has size about one in these
    std::optional<VertexSet> vertices;    ///< proved complete, where few
    Eigen::VectorXd margin;            ///< support: h(a) <= max over points a·v + Σ|a_j| margin_j, roundings included
    Eigen::VectorXd chebyshev_centre;  ///< see Polytope::chebyshev_centre
    double chebyshev_radius = 0.0;     ///< relative to the hull
    Eigen::MatrixXd normals;           ///< facets in z, of norm one, one per column
    Eigen::VectorXd offsets;           ///< their right-hand sides in z
    Eigen::VectorXd norms;             ///< what they were divided by
  };

  /// Takes the intersection of `rows` with a finite box. Throws InvalidArgument when shapes disagree, a number is not
  /// finite, or the set is proved empty.
  Polytope(const std::vector<HalfSpace>& rows, const Box& box, const PolytopeOptions& options = {});

  /// The same, for sets that may be empty: the polytope, or the rows whose multipliers prove that there is none.
  [[nodiscard]] static std::variant<Polytope, std::vector<WeightedRow>> intersect(const std::vector<HalfSpace>& rows,
                                                                                  const Box& box,
                                                                                  const PolytopeOptions& options = {});

  /// Number of parameters p.
  [[nodiscard]] std::size_t dimension() const noexcept { return data_->hull.dimension(); }
  /// The independent blocks.
  [[nodiscard]] const std::vector<Block>& blocks() const noexcept { return data_->blocks; }
  /// All facets with p coefficients each, block by block; sides of the box that matter are among them.
  [[nodiscard]] const std::vector<HalfSpace>& facets() const noexcept { return data_->facets; }
  /// Certified interval hull.
  [[nodiscard]] const Box& hull() const noexcept { return data_->hull; }
  /// Lower bound of each parameter with the rows that prove it (coefficients in all p parameters).
  [[nodiscard]] const std::vector<CertifiedBound>& lower() const noexcept { return data_->lower; }
  /// Upper bound of each parameter with the rows that prove it.
  [[nodiscard]] const std::vector<CertifiedBound>& upper() const noexcept { return data_->upper; }

  /// True if all vertices are known.
  [[nodiscard]] bool has_vertices() const noexcept { return data_->has_vertices; }
  /// Number of vertices, summed over blocks; 0 unless has_vertices().
  [[nodiscard]] std::size_t vertex_count() const noexcept { return data_->vertex_count; }

  /// How far, relative to its size in Block::coordinates, the facets were shifted outward to know the vertices (1e-10
  /// or so, more where many facets meet in one vertex; 0 where they are not known).
  [[nodiscard]] double looseness() const noexcept { return data_->looseness; }

  /// Support function h(a) = max { a·θ : θ in set }, rounded outward, for p finite entries `a` (unchecked): a linear
  /// program per block, certified by its multipliers. Never above the support of hull(), which it falls back to where a
  /// program fails. Allocates (where memory runs out the program terminates).
  [[nodiscard]] double support(std::span<const double> a) const noexcept;
  /// The same, and writes a maximiser (to rounding) to `maximiser` (p entries).
  double support(std::span<const double> a, std::span<double> maximiser) const noexcept;

  /// True if θ satisfies every facet, within the rounding of its evaluation: never false for an exact member.
  [[nodiscard]] bool contains(std::span<const double> theta) const noexcept;

  /// Centre of the largest ball of each block, after division of every parameter by half its hull's width (the ball
  /// then does not depend on units). A member of the set wherever the set has an interior; a least-squares estimate
  /// need not be.
  [[nodiscard]] const std::vector<double>& chebyshev_centre() const noexcept { return data_->centre; }
  [[nodiscard]] const std::vector<double>& centre() const noexcept { return data_->centre; }  ///< the Chebyshev centre

 private:
  struct Data {
    std::vector<Block> blocks;
    std::vector<HalfSpace> facets;
    Box hull;
    std::vector<CertifiedBound> lower, upper;
    std::vector<double> centre;
    bool has_vertices = true;
    std::size_t vertex_count = 0;
    double looseness = 0.0;
  };
  explicit Polytope(std::shared_ptr<const Data> data) : data_(std::move(data)) {}

  std::shared_ptr<const Data> data_;
};

/// Support function of one block of a polytope in the direction of its parameters of `a` (p entries), rounded outward:
/// the largest over the block's vertices plus its margin, or, where they are not known, the support of the block's
/// sides of `hull`. Allocates nothing.
[[nodiscard]] double support_of_vertices(const Polytope::Block& block, const Box& hull,
                                         std::span<const double> a) noexcept;

}  // namespace wheelwright::bounds

namespace wheelwright {
using bounds::Polytope;
}  // namespace wheelwright

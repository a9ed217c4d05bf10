// SPDX-License-Identifier: Apache-2.0
/// \file
/// Ellipsoids of parameters, and the smallest one around a polytope.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/bounds/approximate_inverse.hpp>
#include <wheelwright/bounds/parameter_set.hpp>
#include <wheelwright/bounds/polytope.hpp>

namespace wheelwright {

/// { θ : θ_block = centre + shape u, |u| <= 1 for every block }: an ellipsoid, or a product of ellipsoids in groups of
/// parameters of their own, which is smaller than any one ellipsoid around it. A block of one parameter is an
/// interval.
class Ellipsoid {
 public:
  /// The ellipsoid of a group of parameters.
  struct Block {
    std::vector<std::size_t> parameters;  ///< ascending
    Eigen::VectorXd centre;               ///< q entries, units of the parameters
    Eigen::MatrixXd shape;                ///< q × q: row j has the unit of parameter j
  };

  /// Takes the blocks, whose parameters must number 0 to p − 1, each once. Throws InvalidArgument when they do not,
  /// when shapes disagree or a number is not finite.
  explicit Ellipsoid(std::vector<Block> blocks);
  /// One block of all parameters.
  Ellipsoid(const Eigen::VectorXd& centre, const Eigen::MatrixXd& shape);

  /// Number of parameters p.
  [[nodiscard]] std::size_t dimension() const noexcept { return centre_.size(); }
  /// The factors of the product.
  [[nodiscard]] const std::vector<Block>& blocks() const noexcept { return blocks_; }
  /// Always true: support() never allocates and its work is bounded.
  [[nodiscard]] bool is_online() const noexcept { return true; }
  /// Centres of the blocks.
  [[nodiscard]] const std::vector<double>& centre() const noexcept { return centre_; }

  /// Support function h(a) = Σ_blocks a·centre + |shapeᵀa|, rounded outward: never below the exact value. `a` has p
  /// finite entries (unchecked).
  [[nodiscard]] double support(std::span<const double> a) const noexcept;
  /// The same, and writes the maximiser centre + shape shapeᵀa/|shapeᵀa| (to rounding) to `maximiser` (p entries).
  double support(std::span<const double> a, std::span<double> maximiser) const noexcept;

  /// Whether θ (p entries) lies in the ellipsoid, within the rounding of the test: never false for an exact member.
  [[nodiscard]] bool contains(std::span<const double> theta) const noexcept;

 private:
  struct Membership {
    ApproximateInverse shape;   ///< of Block::shape
    Eigen::VectorXd half_side;  ///< half-widths of the bounding box, rounded up
  };
  std::vector<Block> blocks_;
  std::vector<Membership> membership_;
  std::vector<double> centre_;
};

/// Options of outer_ellipsoid().
struct OuterEllipsoidOptions {
  /// What is made small, block by block.
  enum class Criterion {
    volume,  ///< the volume: does not depend on the coordinates at all
    trace,   ///< Σ_j (half-width of parameter j / half-width of the polytope's hull)²: does not depend on units
  };
  Criterion criterion = Criterion::volume;
  double tolerance = 1e-6;    ///< > 0: stops where no optimality condition is violated by more (relative)
  std::size_t cycles = 1000;  ///< most cycles over slabs or vertices; what is found by then is certified all the same
  std::size_t vertex_limit = 32768;  ///< most vertices of a block enumerated for this, where the polytope holds none
};

/// An ellipsoid (a product of them, one per independent block) that contains the polytope. Two are built, where they
/// can be, and the better one by the criterion is kept:
///
/// - Where the vertices of a block are known: the ellipsoid of least volume around them (VertexEllipsoid).
/// - Every facet i with the support opposite to it gives a slab |a_i·θ − m_i| <= w_i, and for any weights λ >= 0
///
///       E(λ) = { θ : Σ_i λ_i ((a_i·θ − m_i)²/w_i² − 1) <= 0 }
///
///   contains them all (Schweppe 1968; Fogel and Huang 1982). The weights that minimise the criterion are a convex
///   problem in λ, solved by cyclic exact minimisation over one λ_i at a time, in closed form.
///
/// Then inclusion is proved: all vertices, or the quadratic form of the published centre and shape, are enclosed, and
/// the shape is scaled until |u| <= 1 holds for every θ of the block. A parallelotope gives √p times its half-widths, a
/// simplex its Löwner ellipsoid. A block of one parameter is its interval; one that is too flat for doubles gets the
/// ellipsoid of its interval hull.
[[nodiscard]] Ellipsoid outer_ellipsoid(const Polytope& polytope, const OuterEllipsoidOptions& options = {});

}  // namespace wheelwright

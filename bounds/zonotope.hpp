// SPDX-License-Identifier: Apache-2.0
/// \file
/// Zonotopes of parameters, and a small one around a polytope.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/bounds/parameter_set.hpp>
#include <wheelwright/bounds/polytope.hpp>

namespace wheelwright {

/// { θ : θ_block = centre + generators ξ + diag(radius) ζ, |ξ_i| <= 1, |ζ_j| <= 1 for every block }: a zonotope, as the
/// product of zonotopes in groups of parameters of their own.
class Zonotope {
 public:
  /// The zonotope of a group of parameters.
  struct Block {
    std::vector<std::size_t> parameters;  ///< ascending
    Eigen::VectorXd centre;               ///< q entries, units of the parameters
    Eigen::MatrixXd generators;           ///< q × k, one generator a column
    Eigen::VectorXd radius;               ///< q entries >= 0: a small box, for roundings
  };

  /// Takes the blocks, whose parameters must number 0 to p − 1, each once. Throws InvalidArgument when they do not,
  /// when shapes disagree, a number is not finite or a radius is negative.
  explicit Zonotope(std::vector<Block> blocks);
  /// One block of all parameters, without radius.
  Zonotope(const Eigen::VectorXd& centre, const Eigen::MatrixXd& generators);

  /// Number of parameters p.
  [[nodiscard]] std::size_t dimension() const noexcept { return centre_.size(); }
  /// The factors of the product.
  [[nodiscard]] const std::vector<Block>& blocks() const noexcept { return blocks_; }
  /// Number of generators, summed over blocks (those of the radius left out).
  [[nodiscard]] std::size_t generator_count() const noexcept;
  /// Always true: support() never allocates and its work is bounded.
  [[nodiscard]] bool is_online() const noexcept { return true; }
  /// Centres of the blocks.
  [[nodiscard]] const std::vector<double>& centre() const noexcept { return centre_; }

  /// Support function h(a) = Σ_blocks a·centre + Σ_i |a·generator_i| + Σ_j |a_j| radius_j, rounded outward: never below
  /// the exact value. `a` has p finite entries (unchecked).
  [[nodiscard]] double support(std::span<const double> a) const noexcept;
  /// The same, and writes a maximiser (to rounding) to `maximiser` (p entries).
  double support(std::span<const double> a, std::span<double> maximiser) const noexcept;

  /// Whether θ (p entries) is not proved to lie outside: never false for an exact member. Looks for a direction a with
  /// a·θ > h(a), the residual of θ's projection (by coordinate descent) on the zonotope; may be true outside within
  /// about 1e-9 of the zonotope's size, and farther out where the descent converges slowly. Allocates (where memory
  /// runs out the program terminates).
  [[nodiscard]] bool contains(std::span<const double> theta) const noexcept;

 private:
  std::vector<Block> blocks_;
  std::vector<double> centre_;
};

/// Options of outer_zonotope().
struct OuterZonotopeOptions {
  std::size_t order = 4;      ///< most generators of a block, as a multiple of its parameters, >= 1; 1: parallelotopes
  double tolerance = 1e-6;    ///< > 0: stops where no slab's optimality condition is violated by more (relative)
  std::size_t cycles = 1000;  ///< most cycles over the slabs; what is found by then is certified all the same
};

/// A zonotope (a product of them, one per independent block) that contains the polytope. A block of two parameters gets
/// the smaller of outer_zonogon() and of what all others get:
///
/// Each facet i with the support opposite to it gives a slab |a_i·θ − m_i| <= w_i, and so does each side of the
/// interval hull. For any matrix Λ (q × slabs) with Σ_i Λ_i a_iᵀ = I the zonotope Σ_i Λ_i (m_i + w_i ξ_i) contains the
/// block. A parallelotope of q slabs that is intersected with the strips of others, in the way of Alamo, Bravo and
/// Camacho 2005, is one such Λ whatever their λ is; so the best of all Λ is looked for at once: that with the least
/// mean width, Σ_i w_i |Λ_i| in the coordinates that make the block's outer ellipsoid round, which does not depend on
/// the coordinates of the parameters. Its columns are Λ_i w_i = s_i M⁻¹a_i/w_i, M = Σ_i s_i a_i a_iᵀ/w_i², where s >= 0
/// minimises trace M⁻¹ + Σ s: an A-optimal design of experiments (Fedorov 1972), found by exact minimisation over one
/// s_i at a time. Slabs beyond the most that the order allows are dropped smallest first, and the rest is optimised
/// again: nothing is boxed. Then Λ is fixed, and the rounding of Σ_i Λ_i a_iᵀ − I and of the centre goes, enclosed,
/// into the radius.
///
/// A box or a parallelotope is reproduced to rounding. The rule from θ to ξ is linear, so a zonotope of more generators
/// than parameters is not reproduced but in the plane, and the excess grows with the number of parameters. A block that
/// is too flat for doubles gets its interval hull.
[[nodiscard]] Zonotope outer_zonotope(const Polytope& polytope, const OuterZonotopeOptions& options = {});

}  // namespace wheelwright

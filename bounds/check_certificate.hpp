// SPDX-License-Identifier: Apache-2.0
/// \file
/// The checker of certificates: whether multipliers prove a bound, in exact rational arithmetic.
///
/// Whoever doubts a certificate need trust nothing but this file and Boost.Multiprecision: no solver takes part,
/// nothing is rounded before the comparison, every double is the rational number that it is. For any λ >= 0 and any θ
/// in the box with row·θ <= b for every row (Neumaier and Shcherbina 2004; Farkas where a = 0),
///
///     a·θ <= λ·b + Σ_j max { r_j θ_j : θ_j in side j },   r = a − Aᵀλ,
///
/// and the claim is proved where the right-hand side, evaluated exactly, does not exceed it.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bounds/box.hpp"
#include "bounds/slab_rows.hpp"

namespace wheelwright::bounds {

/// Result of a check. A malformed certificate is a result, never an exception, since certificates come from files.
struct CertificateCheck {
  bool proved = false;
  double bound = 0.0;      ///< what is proved, as the smallest double not below it; +∞ where nothing is
  double shortfall = 0.0;  ///< proved − claimed, rounded up: > 0 by how much the proof falls short, else its margin
  /// The row at fault, where one is: it has a multiplier or a shape that no certificate may have, is called a side of
  /// the box and is none, or spoils the proof (what the others prove without it is better; the worst such row).
  std::optional<std::size_t> row;
  /// Where the proof falls short and r may be why: the parameter in which r_j costs most.
  std::optional<std::size_t> parameter;
  std::string reason;  ///< in words why nothing, or not enough, is proved; empty where it is
};

/// Checks that `rows` prove a·θ <= claimed for every θ of `box` that satisfies them.
///
/// At most p + 1 rows, p the sides of the box, with finite multipliers >= 0 and p finite coefficients each. Rows that
/// say of themselves that they are sides of the box (RowOrigin::is_prior) must hold in all of it.
[[nodiscard]] CertificateCheck check_bound(std::span<const double> a, std::span<const WeightedRow> rows, const Box& box,
                                           double claimed);

/// Checks that `rows` prove that no θ of `box` satisfies them all: that 0·θ has an upper bound below zero (`bound`;
/// strictly, so that a `shortfall` of zero is not proved).
[[nodiscard]] CertificateCheck check_emptiness(std::span<const WeightedRow> rows, const Box& box);

/// The smallest double that is not below the sum of `parts`, which is evaluated exactly; +∞ unless all are finite.
[[nodiscard]] double exact_sum(std::span<const double> parts);

/// A claimed bound of one parameter, and the rows that are to prove it.
struct BoundClaim {
  double value = 0.0;             ///< θ_j >= value, or θ_j <= value
  std::vector<WeightedRow> rows;  ///< at most p + 1
};

/// Result of check_hull().
struct HullCheck {
  std::vector<CertificateCheck> lower;  ///< per parameter; `bound` and `shortfall` are of −θ_j <= −value
  std::vector<CertificateCheck> upper;  ///< per parameter
  Box proved;                           ///< contains all θ of the box that satisfy all rows; ends rounded outward
  bool contradiction = false;           ///< the rows leave no θ at all: then every claim is true, and says nothing
  std::size_t rounds = 0;               ///< how often the box was narrowed by what was proved

  /// True if every claim is proved.
  [[nodiscard]] bool all_proved() const;
};

/// Checks that the claims, one lower and one upper bound for each side of `prior`, hold for every θ of `prior` that
/// satisfies the rows of all of them.
///
/// A bound may stand on the others: what is proved narrows the box over which the next is evaluated, round by round
/// until every claim is proved or nothing gets narrower by more than 1e-12 of its width (at most 16 rounds). So the
/// rounding of λ, which leaves r ≠ 0, meets a box as narrow as the set and not the prior's, however wide that is. Every
/// step is a proof by check_bound(). Throws InvalidArgument unless there are as many claims as sides and the prior is
/// finite.
[[nodiscard]] HullCheck check_hull(std::span<const BoundClaim> lower, std::span<const BoundClaim> upper,
                                   const Box& prior);

}  // namespace wheelwright::bounds

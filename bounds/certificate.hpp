// SPDX-License-Identifier: Apache-2.0
/// \file
/// Certificates: rigorous bounds from the approximate multipliers of a linear program, and proofs that a set of
/// parameters is empty.
///
/// Neumaier and Shcherbina 2004, "Safe bounds in linear and mixed-integer linear programming", Math. Program. 99: for
/// any λ >= 0 and any θ in the box with Aθ <= b,
///
///     a·θ = λᵀAθ + (a − Aᵀλ)·θ <= λ·b + max { (a − Aᵀλ)·θ : θ in box }.
///
/// Every product and sum is enclosed (in 113 bits, with a bound on their rounding) and the result rounded outward, Aᵀλ
/// included: nothing depends on how λ was found.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "bounds/box.hpp"
#include "bounds/slab_rows.hpp"

namespace wheelwright::bounds {

/// One certified bound of a parameter over a set, and the rows that set it.
struct CertifiedBound {
  double value = 0.0;                ///< never inside the exact bound
  std::vector<WeightedRow> binding;  ///< at most p rows (sides of the prior box among them) whose multipliers prove it
};

/// λ >= 0 with Aᵀλ = a as nearly as 113 bits allow, for p half-spaces that meet in a vertex: nearly collinear columns
/// make λ large, and its last place as a double is then worth more than the width of the set. `split`: every multiplier
/// as two rows, the double below it and the rest; else rounded to nearest. Negative multipliers are left out. `basis`
/// is returned with its multipliers; empty where the half-spaces are dependent.
[[nodiscard]] std::vector<WeightedRow> refined_multipliers(std::span<const HalfSpace* const> basis,
                                                           std::span<const double> a, bool split);

/// An upper bound of max { a·θ : θ in box, row·θ <= row.b for every row }, proved by the multipliers (those that are
/// not > 0 are left out). `a` and the rows have as many entries as `box` has sides, all finite.
[[nodiscard]] double certified_upper_bound(std::span<const double> a, std::span<const WeightedRow> rows,
                                           const Box& box);

/// True if the multipliers prove that { θ in box : row·θ <= row.b for every row } is empty: that 0·θ has a certified
/// upper bound below zero (Farkas).
[[nodiscard]] bool proves_empty(std::span<const WeightedRow> rows, const Box& box);

/// The 2p half-spaces of a box, lower before upper side, with their origin marked as prior. Where `parameters` is
/// given, side j belongs to parameter parameters[j].
[[nodiscard]] std::vector<HalfSpace> sides_as_rows(const Box& box, std::span<const std::size_t> parameters = {});

/// Looks for a Farkas certificate that { θ in box : row·θ <= row.b for every row } is empty: at most p + 1 of the rows,
/// with multipliers > 0 that proves_empty() accepts, and none of which can be left out (without it no such proof is
/// found). Nothing where no certificate passes the rigorous check, so the set may be non-empty. `coordinates` scale the
/// linear programs only.
[[nodiscard]] std::optional<std::vector<WeightedRow>> find_contradiction(std::span<const HalfSpace> rows,
                                                                         const Box& box,
                                                                         const Coordinates& coordinates);

}  // namespace wheelwright::bounds

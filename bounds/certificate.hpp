// SPDX-License-Identifier: Apache-2.0
/// \file
/// Rigorous bounds from the approximate multipliers of a linear program.
///
/// Neumaier and Shcherbina 2004, "Safe bounds in linear and mixed-integer linear programming", Math. Program. 99: for
/// any λ >= 0 and any θ in the box with Aθ <= b,
///
///     a·θ = λᵀAθ + (a − Aᵀλ)·θ <= λ·b + max { (a − Aᵀλ)·θ : θ in box }.
///
/// Every product and sum is enclosed (in 113 bits, with a bound on their rounding) and the result rounded outward, Aᵀλ
/// included: nothing depends on how λ was found.
#pragma once

#include <span>

#include <wheelwright/bounds/box.hpp>
#include <wheelwright/bounds/half_space.hpp>

namespace wheelwright {

/// An upper bound of max { a·θ : θ in box, row·θ <= row.b for every row }, proved by the multipliers (those that are
/// not > 0 are left out). `a` and the rows have as many entries as `box` has sides, all finite.
[[nodiscard]] double certified_upper_bound(std::span<const double> a, std::span<const WeightedRow> rows,
                                           const Box& box);

/// Whether the multipliers prove that { θ in box : row·θ <= row.b for every row } is empty: that 0·θ has a certified
/// upper bound below zero (Farkas).
[[nodiscard]] bool proves_empty(std::span<const WeightedRow> rows, const Box& box);

}  // namespace wheelwright

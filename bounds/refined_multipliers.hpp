// SPDX-License-Identifier: Apache-2.0
/// \file
/// Multipliers of a vertex to more digits than a double holds.
#pragma once

#include <span>
#include <vector>

#include <wheelwright/bounds/half_space.hpp>

namespace wheelwright {

/// λ >= 0 with Aᵀλ = a as nearly as 113 bits allow, for p half-spaces that meet in a vertex: nearly collinear columns make
/// λ large, and its last place as a double is then worth more than the width of the set. `split`: every multiplier as two
/// rows, the double below it and the rest; else rounded to nearest. Negative multipliers are left out. `basis` is returned
/// with its multipliers; empty where the half-spaces are dependent.
[[nodiscard]] std::vector<WeightedRow> refined_multipliers(std::span<const HalfSpace* const> basis,
                                                           std::span<const double> a, bool split);

}  // namespace wheelwright

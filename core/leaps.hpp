// SPDX-License-Identifier: Apache-2.0
/// \file
/// Single samples that nothing takes which moves: a column leaps away for a row, or up to three, and is back.
#pragma once

#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace wheelwright::core {

/// Rows of a leap at most.
inline constexpr std::size_t kLongestLeap = 3;

/// Leaps that are none of the signal's own, as a share of its size for least_leap().
inline constexpr double kAngleLeap = 0.0, kSpeedLeap = 0.5, kRateLeap = 1.0, kEffortLeap = 3.0;

/// How many rows behind the first of `window`, consecutive rows of a segment, leap by more than `least`: away from the
/// first one, and back to it within half of `least`. 0 where none do, or the window ends before they are back.
[[nodiscard]] std::size_t leap_behind(std::span<const double> window, double least);

/// Rows [first, last) of a segment.
using RowRange = std::pair<std::size_t, std::size_t>;

/// The rows of `values` that leap by more than `least`.
[[nodiscard]] std::vector<bool> leaps_in(std::span<const double> values, std::span<const RowRange> segments,
                                         double least);

/// The size above which a leap of `values` is none of the signal's own: ten times the 99 % quantile of the changes from
/// row to row, and `share` times the 99.9 % quantile of the sizes. Where more than one row in a hundred leaps, these
/// quantiles are the leaps' own: so, for `share` > 0, the first of the rows that do not leap by ten times the 80 %
/// quantile of the changes (nine tenths of all at least), with three times the 99 % quantile of their sizes, does too.
/// Infinite where nothing changes.
[[nodiscard]] double least_leap(std::span<const double> values, std::span<const RowRange> segments, double share);

}  // namespace wheelwright::core

// SPDX-License-Identifier: Apache-2.0
#include "core/leaps.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/statistics.hpp"

namespace wheelwright::core {
namespace {

constexpr double kBackAgain = 0.5;       // of the least leap, by which the row after may differ from the row before
constexpr double kTimesUsual = 10.0;     // of a quantile of changes from row to row
constexpr double kMostLeaps = 0.1;       // share of the rows
constexpr double kTimesTheirSize = 3.0;  // of the rows that do not leap

// Sizes of the values, and of the changes from row to row, of rows that are not left out.
struct Sizes {
  std::vector<double> values, changes;
};

Sizes sizes_of(std::span<const double> values, std::span<const RowRange> segments, const std::vector<bool>& left_out) {
  Sizes sizes;
  for (const auto& [first, last] : segments) {
    std::size_t before = last;
    for (std::size_t k = first; k < last; ++k) {
      if (left_out[k]) {
        continue;
      }
      sizes.values.push_back(std::abs(values[k]));
      if (before != last) {
        sizes.changes.push_back(std::abs(values[k] - values[before]));
      }
      before = k;
    }
  }
  return sizes;
}

}  // namespace

std::size_t leap_behind(std::span<const double> window, double least) {
  for (std::size_t rows = 1; rows <= kLongestLeap && rows + 1 < window.size(); ++rows) {
    const double leap = std::min(std::abs(window[1] - window[0]), std::abs(window[rows] - window[rows + 1]));
    if (leap > least && std::abs(window[rows + 1] - window[0]) < kBackAgain * least) {
      return rows;
    }
  }
  return 0;
}

std::vector<bool> leaps_in(std::span<const double> values, std::span<const RowRange> segments, double least) {
  std::vector<bool> leaps(values.size(), false);
  for (const auto& [first, last] : segments) {
    for (std::size_t k = first; k < last; ++k) {
      const std::size_t rows = leap_behind(values.subspan(k, std::min(kLongestLeap + 2, last - k)), least);
      std::fill_n(leaps.begin() + static_cast<std::ptrdiff_t>(k + 1), rows, true);
      k += rows;
    }
  }
  return leaps;
}

double least_leap(std::span<const double> values, std::span<const RowRange> segments, double share) {
  const Sizes all = sizes_of(values, segments, std::vector<bool>(values.size(), false));
  double least = std::max(kTimesUsual * quantile(all.changes, 0.99), share * quantile(all.values, 0.999));
  const std::vector<bool> leaps = leaps_in(values, segments, kTimesUsual * quantile(all.changes, 0.8));
  const auto many = static_cast<double>(std::ranges::count(leaps, true));
  if (share > 0.0 && many > 0.0 && many <= kMostLeaps * static_cast<double>(all.values.size())) {
    const Sizes others = sizes_of(values, segments, leaps);
    const double size = quantile(others.values, 0.99);
    if (size > 0.0) {
      least = std::min(least, std::max(kTimesUsual * quantile(others.changes, 0.99), kTimesTheirSize * size));
    }
  }
  return least > 0.0 ? least : std::numeric_limits<double>::infinity();
}

}  // namespace wheelwright::core

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Closed intervals with outward rounding.
///
/// Every operation returns an interval that contains the exact result for all points of its operands: the rounded-to-
/// nearest result is moved outward by one unit in the last place (std::nextafter), which encloses it in every rounding
/// mode a compiler may assume. Moore, Kearfott and Cloud 2009, chapter 2.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

namespace wheelwright::core {

/// The next double above `x` (std::nextafter, without a call); +infinity and what is no number stay.
inline double round_up(double x) {
  if (!(x < std::numeric_limits<double>::infinity())) {
    return x;
  }
  // Doubles of one sign follow each other as their bits do.
  const auto bits = std::bit_cast<std::int64_t>(x);
  const bool zero = bits == 0 || bits == std::numeric_limits<std::int64_t>::min();
  return std::bit_cast<double>(zero ? std::int64_t{1} : bits > 0 ? bits + 1 : bits - 1);
}
/// The next double below `x`; −infinity and what is no number stay.
inline double round_down(double x) { return -round_up(-x); }

/// A closed interval [lower, upper]; lower <= upper wherever it is an answer.
struct Interval {
  double lower = 0.0;  ///< lower end, unit of the quantity
  double upper = 0.0;  ///< upper end, unit of the quantity

  /// Length of the interval, rounded up.
  [[nodiscard]] double width() const { return round_up(upper - lower); }
  /// Mid-point, rounded to nearest.
  [[nodiscard]] double centre() const { return lower + 0.5 * (upper - lower); }
  /// True if `x` lies in the interval, ends included.
  [[nodiscard]] bool contains(double x) const { return lower <= x && x <= upper; }
  friend bool operator==(const Interval&, const Interval&) = default;
};

/// [x, x].
inline Interval point(double x) { return {x, x}; }
/// Largest |x| of the interval.
inline double magnitude(Interval x) { return std::max(std::abs(x.lower), std::abs(x.upper)); }

/// { x + y }, enclosed.
inline Interval operator+(Interval x, Interval y) {
  return {round_down(x.lower + y.lower), round_up(x.upper + y.upper)};
}

/// { x − y }, enclosed.
inline Interval operator-(Interval x, Interval y) {
  return {round_down(x.lower - y.upper), round_up(x.upper - y.lower)};
}

/// { x·y }, enclosed.
inline Interval operator*(Interval x, Interval y) {
  const double a = x.lower * y.lower, b = x.lower * y.upper, c = x.upper * y.lower, d = x.upper * y.upper;
  return {round_down(std::min({a, b, c, d})), round_up(std::max({a, b, c, d}))};
}

}  // namespace wheelwright::core

namespace wheelwright {
using core::Interval;
}  // namespace wheelwright

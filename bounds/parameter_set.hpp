// SPDX-License-Identifier: Apache-2.0
/// \file
/// What a set of parameters is, and what can be measured of any of them.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/bounds/box.hpp>
#include <wheelwright/core/check.hpp>

namespace wheelwright {

/// A non-empty compact convex set of p parameters, known through its support function h(a) = max { a·θ : θ in set }.
///
/// - `support(a)`: h(a) for p finite entries, rounded outward: never below the exact value, 0 for a = 0.
/// - `support(a, at)`: the same, and writes a maximiser (to rounding) to the p entries of `at`.
/// - `contains(theta)`: never false for an exact member; where it is false, θ is proved to lie outside.
/// - `centre()`: a member wherever the set has an interior.
/// - `is_online()`: whether support() allocates nothing and its work is bounded.
///
/// The set of all exact members is the one that a type states; outer sets contain what they were built from.
template <class Set>
concept ParameterSet = requires(const Set& set, std::span<const double> a, std::span<double> at) {
  { set.dimension() }
  noexcept->std::same_as<std::size_t>;
  { set.support(a) }
  noexcept->std::same_as<double>;
  { set.support(a, at) }
  noexcept->std::same_as<double>;
  { set.contains(a) }
  noexcept->std::same_as<bool>;
  { set.centre() } -> std::convertible_to<std::vector<double>>;
  { set.is_online() }
  noexcept->std::same_as<bool>;
};

/// Width of the set across direction `a`, h(a) + h(−a), rounded outward. `a` has p finite entries.
template <ParameterSet Set>
[[nodiscard]] double width(const Set& set, std::span<const double> a) {
  std::vector<double> opposite(a.begin(), a.end());
  for (double& x : opposite) {
    x = -x;
  }
  const double sum = set.support(a) + set.support(opposite);
  return sum == 0.0 ? 0.0 : round_up(sum);
}

/// Mean of the widths across `directions` (p × n, one direction a column, n >= 1), in the units of a·θ. Throws
/// InvalidArgument when shapes disagree.
template <ParameterSet Set>
[[nodiscard]] double mean_width(const Set& set, const Eigen::MatrixXd& directions) {
  const auto p = static_cast<Eigen::Index>(set.dimension());
  check::that(directions.rows() == p && directions.cols() > 0, "directions", "one column of p entries or more");
  double sum = 0.0;
  for (Eigen::Index k = 0; k < directions.cols(); ++k) {
    sum += width(set, std::span<const double>(directions.col(k).data(), set.dimension()));
  }
  return sum / static_cast<double>(directions.cols());
}

/// How much wider an outer set is than the set it was built from: ratios of widths, >= 1 up to rounding.
struct Looseness {
  double median = 1.0;  ///< upper median over the directions
  double worst = 1.0;   ///< largest
};

/// Ratios of the widths of `outer` to those of `inner` across `directions` (p × n, one a column, n >= 1). Directions
/// across which both are flat count as 1. Throws InvalidArgument when shapes disagree.
template <ParameterSet Outer, ParameterSet Inner>
[[nodiscard]] Looseness looseness(const Outer& outer, const Inner& inner, const Eigen::MatrixXd& directions) {
  const std::size_t p = inner.dimension();
  check::that(outer.dimension() == p, "outer set", "the dimension of the inner one");
  check::that(directions.rows() == static_cast<Eigen::Index>(p) && directions.cols() > 0, "directions",
              "one column of p entries or more");
  std::vector<double> ratios;
  for (Eigen::Index k = 0; k < directions.cols(); ++k) {
    const std::span<const double> a(directions.col(k).data(), p);
    const double wide = width(outer, a), narrow = width(inner, a);
    ratios.push_back(wide == 0.0 && narrow == 0.0 ? 1.0 : wide / narrow);
  }
  const auto middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return {*middle, *std::max_element(ratios.begin(), ratios.end())};
}

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Concept of a set of parameters, and measurements on any of them.
#pragma once

#include <concepts>
#include <cstddef>
#include <span>
#include <vector>

#include "bounds/box.hpp"

namespace wheelwright::bounds {

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
};

/// Width of the set across direction `a`, h(a) + h(−a), rounded outward. `a` has p finite entries.
template <ParameterSet Set>
[[nodiscard]] double width(const Set& set, std::span<const double> a) {
  std::vector<double> opposite(a.begin(), a.end());
  for (double& x : opposite) {
    x = -x;
  }
  const double sum = set.support(a) + set.support(opposite);
  return sum == 0.0 ? 0.0 : core::round_up(sum);
}

}  // namespace wheelwright::bounds

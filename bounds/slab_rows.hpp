// SPDX-License-Identifier: Apache-2.0
/// \file
/// From rows of a regression with bounded errors to half-spaces of parameters (theory: errors in variables).
#pragma once

#include <span>
#include <vector>

#include <wheelwright/bounds/box.hpp>
#include <wheelwright/bounds/half_space.hpp>
#include <wheelwright/core/regression.hpp>

namespace wheelwright {

/// Turns the row |y − Y°θ| <= dy, |Y° − Y| <= dY into the two half-spaces it means for θ in a prior box:
///
///     (Y − σ dY)θ <= y + dy   and   (Y + σ dY)θ >= y − dy,   σ_j = +1 where θ_j >= 0, −1 where θ_j <= 0.
///
/// Where the box leaves the sign of θ_j open and dY_j > 0, |θ_j| is replaced by its chord over the side,
/// |θ_j| <= (s θ_j + t), s = (u + l)/(u − l), t = −2ul/(u − l): the convex hull of that row's set, an outer
/// description. All rounding is outward: no admissible θ of the box is cut off.
class SlabRows {
 public:
  /// Throws InvalidArgument unless the box is finite.
  explicit SlabRows(const Box& prior);

  /// Writes the half-spaces of row `row` of `block`, which has as many parameters as the box.
  void half_spaces(const RegressionBlock& block, Eigen::Index row, HalfSpace& upper, HalfSpace& lower) const;

  /// The same for a row by itself; `upper.origin` says where it comes from.
  void half_spaces(std::span<const double> Y, std::span<const double> dY, double y, double dy, const RowOrigin& origin,
                   HalfSpace& upper, HalfSpace& lower) const;

  /// Whether the sign of θ_j is open.
  [[nodiscard]] bool sign_is_open(std::size_t j) const { return open_[j]; }

 private:
  std::vector<bool> open_;
  std::vector<double> sign_;
  std::vector<Interval> slope_, intercept_;
  std::vector<double> magnitude_;
};

}  // namespace wheelwright

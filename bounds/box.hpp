// SPDX-License-Identifier: Apache-2.0
/// \file
/// Boxes of parameters, their support function, and coordinates in which a set is round.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "core/check.hpp"
#include "core/interval.hpp"

namespace wheelwright::bounds {

/// { θ : lower_j <= θ_j <= upper_j }. Sides have the units of the parameters.
struct Box {
  std::vector<Interval> sides;  ///< one side per parameter

  /// Number of parameters p.
  [[nodiscard]] std::size_t dimension() const noexcept { return sides.size(); }

  /// Support function h(a) = max { a·θ : θ in box } = Σ_j max(a_j lower_j, a_j upper_j), rounded outward: never below
  /// the exact value. `a` has p finite entries (unchecked). Allocates nothing.
  [[nodiscard]] double support(std::span<const double> a) const noexcept {
    double sum = 0.0, magnitude = 0.0;
    for (std::size_t j = 0; j < sides.size(); ++j) {
      const double term = std::max(a[j] * sides[j].lower, a[j] * sides[j].upper);
      sum += term;
      magnitude += std::abs(term);
    }
    return magnitude == 0.0 && is_zero(a) ? 0.0 : outward(sum, magnitude, sides.size());
  }

  /// `sum` of p products whose sizes add up to `magnitude`, rounded as support() promises.
  [[nodiscard]] static double outward(double sum, double magnitude, std::size_t p) noexcept {
    // Rounding of p products and p sums is at most (p + 1)·2⁻⁵³·Σ|term| plus an underflow each (Higham 2002, section
    // 3.1); eight times that covers the rounding of the bound itself.
    constexpr double epsilon = std::numeric_limits<double>::epsilon();
    const double n = static_cast<double>(p);
    return sum + (4.0 * (n + 1.0) * epsilon * magnitude + 2.0 * n * std::numeric_limits<double>::min());
  }

  /// The same, and writes a corner where the maximum is attained to `maximiser` (p entries).
  double support(std::span<const double> a, std::span<double> maximiser) const noexcept {
    for (std::size_t j = 0; j < sides.size(); ++j) {
      maximiser[j] = a[j] > 0.0 ? sides[j].upper : sides[j].lower;
    }
    return support(a);
  }

  /// True if θ lies in the box, sides included. `theta` has p entries.
  [[nodiscard]] bool contains(std::span<const double> theta) const noexcept {
    for (std::size_t j = 0; j < sides.size(); ++j) {
      if (!sides[j].contains(theta[j])) {
        return false;
      }
    }
    return true;
  }

  /// Mid-point of every side.
  [[nodiscard]] std::vector<double> centre() const {
    std::vector<double> c;
    c.reserve(sides.size());
    for (const Interval& side : sides) {
      c.push_back(side.centre());
    }
    return c;
  }

  /// Largest |θ_j| of every side.
  [[nodiscard]] Eigen::VectorXd magnitudes() const {
    Eigen::VectorXd m(static_cast<Eigen::Index>(sides.size()));
    std::transform(sides.begin(), sides.end(), m.begin(), core::magnitude);
    return m;
  }

  friend bool operator==(const Box&, const Box&) = default;

 private:
  [[nodiscard]] static bool is_zero(std::span<const double> a) noexcept {
    return std::all_of(a.begin(), a.end(), [](double x) { return x == 0.0; });
  }
};

/// Throws InvalidArgument, naming `what`, unless every side is finite and lower <= upper.
inline void check_finite(const Box& box, const char* what) {
  for (const Interval& side : box.sides) {
    check::that(std::isfinite(side.lower) && std::isfinite(side.upper) && side.lower <= side.upper, what,
                "finite sides with lower <= upper");
  }
}

/// The smallest box that contains both. Throws InvalidArgument unless the dimensions agree.
[[nodiscard]] inline Box hull(const Box& x, const Box& y) {
  check::that(x.dimension() == y.dimension(), "hull", "boxes of the same dimension");
  Box result = x;
  for (std::size_t j = 0; j < y.sides.size(); ++j) {
    result.sides[j] = {std::min(x.sides[j].lower, y.sides[j].lower), std::max(x.sides[j].upper, y.sides[j].upper)};
  }
  return result;
}

/// Affine coordinates z of parameters in which a set has a size of about one: θ = centre + transform z.
struct Coordinates {
  Eigen::VectorXd centre;     ///< θ at z = 0
  Eigen::MatrixXd transform;  ///< p × p, regular
};

/// Coordinates about the centre of `box` with Tᵀ (information + D⁻²) T ≈ 1, D the half-widths of the box: whitened
/// where `information` (p × p, symmetric, positive semi-definite, units 1/θ²) says something, as wide as the box
/// elsewhere.
[[nodiscard]] Coordinates whitened(const Box& box, const Eigen::MatrixXd& information);

/// Half-widths of a box about the origin of z that contains `box` (to rounding).
[[nodiscard]] Eigen::VectorXd extent(const Box& box, const Coordinates& coordinates);

}  // namespace wheelwright::bounds

namespace wheelwright {
using bounds::Box;
}  // namespace wheelwright

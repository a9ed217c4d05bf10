// SPDX-License-Identifier: Apache-2.0
/// \file
/// Filtered rows of a simulated differential-drive robot whose effects couple its two channels, for benchmarks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "bounds/box.hpp"
#include "core/regression.hpp"

namespace wheelwright::bench {

/// Noise of the filtered torque, and the bound ē that is stated for it.
enum class RowNoise {
  uniform,   ///< u: independent uniform on [−ē, ē], and exactly ē is stated: a tight set
  gaussian,  ///< g: independent Gaussian of deviation ē/3, cut at ±ē; 1.1 ē is stated
  coloured,  ///< s: uniform on [−ē, ē] with a correlation time of 0.1 s; 1.1 ē is stated
};

/// N rows y = Yθ + e with |e| <= dy, by columns. Row 2k is the sum channel (N·m) at instant k, row 2k + 1 the
/// difference channel (N·m²); every column has the unit of its parameter, as the robot has it.
struct DriveRows {
  static constexpr std::size_t outputs = 2;  ///< rows of an instant

  std::size_t n = 0;            ///< N, even
  std::size_t p = 0;            ///< number of parameters
  std::vector<double> columns;  ///< p blocks of n: Y by columns
  std::vector<double> y;        ///< n
  std::vector<double> dy;       ///< n, the stated bound, one number per channel
  std::vector<double> truth;    ///< p, inside the feasible set
  Box prior;                    ///< wide physical bounds, finite

  /// Column j, n numbers.
  [[nodiscard]] const double* column(std::size_t j) const { return columns.data() + j * n; }
};

/// Rows of a robot that follows slow multi-sine speeds at 100 Hz, with reversals and turns, filtered by f₂ with
/// α = β = 20/s as the library filters them (model/filter/kernel.hpp): neighbouring rows of a channel are nearly equal.
///
///     p = 4   mass, yaw inertia, viscous friction of the right and of the left wheel
///     p = 6   and offset of the centre of mass (−v2², v1 v2), viscous friction of yaw
///     p = 8   and dry friction of either wheel
///     p = 12  and torque offset of either wheel, slope of the ground along two axes
///
/// The same arguments give the same rows (to the last digit of the machine's sine). Throws InvalidArgument unless `n`
/// is even and > 0, and p is one of these.
[[nodiscard]] DriveRows drive_rows(std::size_t n, std::size_t p, RowNoise noise, std::uint64_t seed = 1);

/// The same rows as the library takes them, two outputs to an instant, dY = 0.
[[nodiscard]] RegressionBlock as_block(const DriveRows& rows);

/// The first `count` rows as directions, row-major (count × p): the sum channel first, then the difference channel, so
/// that neighbours are nearly equal. `count` is even and <= n (checked).
[[nodiscard]] std::vector<double> directions(const DriveRows& rows, std::size_t count);

}  // namespace wheelwright::bench

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Interface of the detectors that are compared: each turns an instant into test statistics with a limit.
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "model/filter/regressor_filter.hpp"

namespace wheelwright::peers {

/// Outputs of the two-wheel robot: sum and difference.
inline constexpr std::size_t kOutputs = 2;

/// One row of the log and what the filter made of it: all detectors see the same.
struct Observation {
  double t = 0.0;                                    ///< s
  std::span<const double> sample{};                  ///< the row as logged, in the order of the measurement's columns
  std::array<double, kOutputs> position{};           ///< of the coordinates, from the wheel angles as logged, m, rad
  std::array<double, kOutputs> effort{};             ///< left side of (15) as logged, N·m, N·m²
  bool valid = false;                                ///< whether there is a filtered row
  const filter::FilteredRow* row = nullptr;          ///< where valid
  const filter::FilteredRow* statistical = nullptr;  ///< the same with statistical bounds dY and dy, where valid
  std::array<double, kOutputs> residual{};           ///< ε = τ_f − Y_f θ̂, where valid
};

/// A detector without its limits. It raises an alarm where one of its values exceeds the limit of that value.
class Statistic {
 public:
  virtual ~Statistic() = default;
  /// Number of values an instant gives.
  [[nodiscard]] virtual std::size_t size() const = 0;
  /// Forgets everything: another log begins.
  virtual void restart() = 0;
  /// Takes the next row of the log and writes size() values >= 0; zeros while there is nothing to say.
  virtual void step(const Observation& now, std::span<double> values) = 0;
  /// The limit that is `margin` (>= 1) times as far out as `largest`, in standard deviations of a Gaussian residual.
  [[nodiscard]] virtual double with_margin(double largest, double margin) const { return margin * largest; }
};

}  // namespace wheelwright::peers

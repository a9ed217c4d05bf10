// SPDX-License-Identifier: Apache-2.0
/// \file
/// How noisy a sampled signal is, from its differences alone: a smooth signal vanishes in them, white noise does not.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <wheelwright/core/log.hpp>

namespace wheelwright {

/// Noise of one column of a log.
struct DifferenceNoise {
  static constexpr std::size_t kOrders = 6;
  /// What the differences look like.
  enum class Kind {
    none,    ///< nothing is left: no noise that differences can show
    white,   ///< as from independent noise: `sd` is its standard deviation
    smooth,  ///< less and less remains: motion too fast for the sampling, or low-passed noise; `sd` is too large or too
             ///< small accordingly
    rough,   ///< more and more remains: neighbouring errors of opposite sign, as in speeds made of differenced angles
    too_short,  ///< fewer than 50 windows of equal steps
  };
  Kind kind = Kind::too_short;
  double sd = 0.0;           ///< unit of the column, from differences of order kOrders
  double relative_sd = 0.0;  ///< standard error of sd², relative to it, for white noise
  std::array<double, kOrders>
      by_order{};           ///< √(mean (Δᵈx)²/C(2d, d)), d = 1, 2, …: alike once only white noise is left
  std::size_t windows = 0;  ///< number of windows that were used
};

/// The noise of each of `columns` of `log`, one walk. Only windows of kOrders + 1 samples at equal steps (to a tenth) in
/// one segment are used. Assumes noise that is independent from sample to sample, and a signal whose sixth difference is
/// smaller than its noise (von Neumann 1941 for order 1; Hall, Kay and Titterington 1990): `kind` says whether the log
/// looks like that. Throws InvalidArgument when a column is missing.
[[nodiscard]] std::vector<DifferenceNoise> difference_noise(LogSource& log, const std::vector<std::string>& columns);

}  // namespace wheelwright

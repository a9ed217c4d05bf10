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
    rough,   ///< more and more remains: neighbouring errors of opposite sign, as in speeds made of differenced angles;
             ///< `sd` is too large
    too_short,  ///< fewer than 50 windows of equal steps
  };
  Kind kind = Kind::too_short;
  double sd = 0.0;  ///< unit of the column, from differences of order kOrders
  double relative_sd =
      0.0;  ///< standard error of sd², relative to it, for white Gaussian noise: √(2 C(4d, 2d)/N)/C(2d, d)
            ///< at N windows and d = kOrders (√(e/N) more, in squares, for noise of excess kurtosis e)
  std::array<double, kOrders>
      by_order{};              ///< √(mean (Δᵈx)²/C(2d, d)), d = 1, 2, …: alike once only white noise is left
  std::size_t level_from = 0;  ///< smallest order from which on all are alike; 0 unless white
  double hidden = 0.0;  ///< relative error of sd² that a correlation of neighbouring errors could cause without being
                        ///< noticed in the orders from `level_from` on; 0 unless white
  std::size_t windows = 0;  ///< number of windows N that were used
};

/// The noise of each of `columns` of `log`, one walk. Only windows of kOrders + 1 samples at equal steps (to a tenth)
/// in one segment are used. Assumes noise that is independent from sample to sample, exact time stamps, and a signal
/// whose sixth difference is smaller than its noise (von Neumann et al. 1941 for order 1; Hall, Kay and Titterington
/// 1990).
///
/// `kind` says whether the log looks like that. Mean squares of orders d and e of white noise agree up to
///
///     var(log v_d/v_e) = 2/N · (C(4d, 2d)/C(2d, d)² + C(4e, 2e)/C(2e, e)² − 2 C(2d + 2e, d + e)/(C(2d, d) C(2e, e)))
///
/// for whatever distribution, since its kurtosis cancels. It is smooth where the last order is less than the one before
/// by four such standard errors, rough where it is more than any before (a signal left in low orders can only hide
/// that), and in either case by no less than what a correlation at lag one makes that falsifies sd² by a tenth. A
/// correlation ρ at lag one changes v_d by −2dρ/(d + 1): high orders alone hardly tell ρ from white noise, and
/// `hidden` says how much of it could be there.
/// Throws InvalidArgument when a column is missing.
[[nodiscard]] std::vector<DifferenceNoise> difference_noise(LogSource& log, const std::vector<std::string>& columns);

}  // namespace wheelwright

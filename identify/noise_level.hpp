// SPDX-License-Identifier: Apache-2.0
/// \file
/// Noise levels: of a signal from its differences, of noise shared by two signals, of the equation error from
/// fault-free residuals.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "identify/least_squares.hpp"

namespace wheelwright::identify {

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

/// True if column first[i] of `log` carries noise of column second[i], for any i: if their sixth differences, in which
/// motion is next to nothing and noise is large, are correlated at the same sample or up to three samples later. Said
/// so above |ρ| = 0.1 and six standard errors of independent white series, 6·√C(24, 12)/C(12, 6)/√N. One walk; windows
/// as in noise_level.hpp. A column that is smooth down to rounding carries no noise. Throws InvalidArgument when a
/// column is missing or the lists differ in length.
[[nodiscard]] bool share_noise(LogSource& log, const std::vector<std::string>& first,
                               const std::vector<std::string>& second);

/// Promise of the extrapolated bound.
struct ExtrapolationOptions {
  double risk = 1e-3;    ///< probability, per output, that a fault-free log of the horizon exceeds the bound
  double horizon = 1.0;  ///< number of instants of the horizon, as a multiple of those that were seen
};

/// A bound and how it came about.
struct ExtrapolatedBound {
  double bound = 0.0;         ///< ē, unit of the output
  double over_largest = 0.0;  ///< ē / max |ε|
  double over_rms = 0.0;      ///< ē / rms
  bool heavy_tail = false;    ///< the residual's tail is heavier than a Gaussian one: the bound stands on the largest
                              ///< residual and an exponential tail instead
};

/// ē = z·σ_u, where σ_u = rms·√(n/χ²_{n,risk}) is the upper confidence limit of the standard deviation for n effective
/// instants (autocorrelated residuals know their own size less well than their number suggests), and z the Gaussian
/// quantile of risk shared over both sides of all instants of the horizon (union bound: no independence needed).
///
/// Where max |ε| or the kurtosis is larger than Gaussian residuals would show with probability `risk`, the tail is
/// taken to fall by e over each further `rms`, from the largest residual on: ē = max|ε| + rms·ln(horizon/risk).
///
/// The extrapolation assumes that future driving has the same noise and the same unmodelled rest as the log.
[[nodiscard]] ExtrapolatedBound extrapolate(const OutputResidual& residual, std::size_t instants,
                                            const ExtrapolationOptions& options = {});

/// Per output, the largest equation error |y − Yθ| that the rows of a log can have had at the *true* parameters, at
/// confidence 1 − risk: the residual |y − Yθ̂| that was seen, and what θ̂ may be off by,
///
///     max over rows of |y − Yθ̂| + √(p·F_{p,ν}(1 − risk) · Y Σ Yᵀ)
///
/// with Σ the covariance of θ̂ and ν its degrees of freedom (Scheffé: all rows at once), in each row whichever says
/// more of `summary`'s two: what residuals say where the parameters are seen, which is little of one that is seen once
/// (OutputResidual::fit_freedom), and what they say everywhere. Nothing is extrapolated: the rows are those that were
/// seen. One walk over `rows`.
[[nodiscard]] Eigen::VectorXd largest_plausible_error(core::RegressionSource& rows, const Eigen::VectorXd& theta,
                                                      const ResidualSummary& summary, double risk);

}  // namespace wheelwright::identify

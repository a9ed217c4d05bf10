// SPDX-License-Identifier: Apache-2.0
/// \file
/// A bound on the equation error, extrapolated from the residuals of fault-free driving.
#pragma once

#include <wheelwright/identify/residual_statistics.hpp>

namespace wheelwright {

/// What the extrapolated bound promises.
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
/// Where max |ε| or the kurtosis is larger than Gaussian residuals would show with probability `risk`, the tail is taken to fall by e
/// over each further `rms`, from the largest residual on: ē = max|ε| + rms·ln(horizon/risk).
///
/// The extrapolation assumes that future driving has the same noise and the same unmodelled rest as the log.
[[nodiscard]] ExtrapolatedBound extrapolate(const OutputResidual& residual, std::size_t instants,
                                            const ExtrapolationOptions& options = {});

/// Per output, the largest equation error |y − Yθ| that the rows of a log can have had at the *true* parameters, at
/// confidence 1 − risk: the residual |y − Yθ̂| that was seen, and what θ̂ may be off by,
///
///     max over rows of |y − Yθ̂| + √(p·F_{p,ν}(1 − risk) · Y Σ Yᵀ)
///
/// with Σ the covariance of θ̂ and ν its degrees of freedom (Scheffé: all rows at once). Nothing is extrapolated: the
/// rows are those that were seen. One walk over `rows`.
[[nodiscard]] Eigen::VectorXd largest_plausible_error(RegressionSource& rows, const Eigen::VectorXd& theta,
                                                      const ResidualSummary& summary, double risk);

}  // namespace wheelwright

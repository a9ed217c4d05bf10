// SPDX-License-Identifier: Apache-2.0
/// \file
/// A bound |n| <= n̄ for the feasible sets, made of a standard deviation, and what it promises.
#pragma once

#include <string_view>

namespace wheelwright {

/// What is assumed of the noise's distribution.
enum class NoiseLaw {
  uniform,       ///< on an interval, as rounding to decimals or counts is
  gaussian,      ///< tails as light as a Gaussian's
  any_variance,  ///< a finite variance and nothing else
};

/// Name for people and files: "uniform", …
[[nodiscard]] std::string_view to_string(NoiseLaw law);

/// What the bound is to hold for.
struct ErrorBoundOptions {
  NoiseLaw law = NoiseLaw::gaussian;
  double horizon = 1e6;  ///< samples of one column that are all to obey it
  double risk = 1e-3;    ///< probability that one of them does not, the standard deviation's own error included
};

/// A bound and how it came about: `bound` = `factor` · `sd_limit`.
struct ErrorBound {
  double bound = 0.0;     ///< n̄, unit of the standard deviation
  double sd_limit = 0.0;  ///< upper confidence limit of the standard deviation, at risk/2 (risk for the uniform law)
  double factor = 0.0;
};

/// n̄ = k·σ_u with σ_u = sd·√(ν/χ²_{ν, risk/2}) and ν = 2/relative_sd² the degrees of freedom of sd² (relative_sd is
/// the standard error of sd² relative to it; 0 for an sd that is known), and by the law
///
///     uniform       k = √3: the end of the interval itself, whatever the horizon
///     gaussian      k = z(risk/(4·horizon)), the upper quantile: both tails, union over the horizon
///     any_variance  k = √(2·horizon/risk): Chebyshev, union over the horizon
///
/// A union needs no independence. The promise: future noise of the same law and size keeps |n| <= n̄ in all of the
/// horizon's samples with probability 1 − risk. It is no guarantee: rare events that the sd has not seen (slip, a
/// dropped message) obey no law. Throws InvalidArgument unless sd >= 0, relative_sd >= 0, horizon >= 1 and risk is
/// inside (0, 1).
[[nodiscard]] ErrorBound bound_of_sd(double sd, double relative_sd, const ErrorBoundOptions& options = {});

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Error bounds from standard deviations, and the choice among several noise levels of a column.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <wheelwright/identify/noise_level.hpp>
#include <wheelwright/inference/standstill_noise.hpp>

namespace wheelwright::inference {

/// Assumed distribution of the noise.
enum class NoiseLaw {
  uniform,       ///< on an interval, as rounding to decimals or counts is
  gaussian,      ///< tails as light as a Gaussian's
  any_variance,  ///< a finite variance and nothing else
};

/// Scope of the bound.
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

/// Method by which a noise level was found.
enum class NoiseMethod { none, standstill, differences };

/// Name for people and files: "none", "standstill", …
[[nodiscard]] std::string_view to_string(NoiseMethod method);

/// Evidence on the noise of one column.
struct NoiseEvidence {
  std::optional<StandstillNoise> standstill;
  std::optional<identify::DifferenceNoise> differences;
};

/// Relation of the chosen level to the true one.
enum class NoiseMeaning {
  estimate,     ///< the assumption behind it is borne out as far as the log can tell
  upper_limit,  ///< holds more than the sensor's noise
  lower_limit,  ///< the noise in motion may be larger
  unknown,      ///< nothing can be said; the level is 0
};

/// The level to use for one column.
struct NoiseChoice {
  NoiseMethod method = NoiseMethod::none;
  NoiseMeaning meaning = NoiseMeaning::unknown;
  double sd = 0.0;           ///< unit of the column
  double relative_sd = 0.0;  ///< standard error of sd², relative to it
  ErrorBound bound;          ///< for the feasible sets (noise_choice.hpp)
  std::string assumption;    ///< what the level assumes, e.g. "noise independent from sample to sample"
  std::string reason;        ///< one sentence: why this one
};

/// Differences where they look white, because they are of the sensor in motion; unless standstill is larger by three
/// standard errors, since differences do not see correlated noise. Then standstill, as a lower limit; then rough
/// differences, as an upper limit. Smooth differences are never used: they may be wrong either way. The bound is made
/// for `options`; where standstill is used, it is no less than the one extrapolated there.
[[nodiscard]] NoiseChoice choose_noise(const NoiseEvidence& evidence, const ErrorBoundOptions& options = {});

}  // namespace wheelwright::inference

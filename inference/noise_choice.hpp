// SPDX-License-Identifier: Apache-2.0
/// \file
/// Which of several noise levels of a column to use, and why.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <wheelwright/identify/difference_noise.hpp>
#include <wheelwright/inference/error_bound.hpp>
#include <wheelwright/inference/repeat_noise.hpp>
#include <wheelwright/inference/standstill_noise.hpp>

namespace wheelwright {

/// How a noise level was found.
enum class NoiseMethod { none, standstill, repeats, differences };

/// Name for people and files: "none", "standstill", …
[[nodiscard]] std::string_view to_string(NoiseMethod method);

/// What is known about the noise of one column.
struct NoiseEvidence {
  std::optional<StandstillNoise> standstill;
  std::optional<RepeatNoise> repeats;  ///< of runs that are repeats (RepeatStatus::repeats)
  std::optional<DifferenceNoise> differences;
};

/// How the chosen level stands to the true one.
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
  ErrorBound bound;          ///< for the feasible sets (error_bound.hpp)
  std::string assumption;    ///< what the level assumes, e.g. "noise independent from sample to sample"
  std::string reason;        ///< one sentence: why this one
};

/// Differences where they look white, because they are of the sensor in motion and need no second run; unless another
/// level is larger by three standard errors and not driving that failed to repeat, since differences do not see
/// correlated noise. Then repeats whose differences are uncorrelated (|ρ| < 0.2 at lag one); then standstill, as a
/// lower limit; then correlated repeats or rough differences, as an upper limit. Smooth differences are never used:
/// they may be wrong either way. The bound is made for `options`; where standstill is used, it is no less than the one
/// extrapolated there.
[[nodiscard]] NoiseChoice choose_noise(const NoiseEvidence& evidence, const ErrorBoundOptions& options = {});

}  // namespace wheelwright

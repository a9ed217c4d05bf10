// SPDX-License-Identifier: Apache-2.0
/// \file
/// Noise levels of the columns of a log: while the robot stands still, the choice among several of one column, and
/// error bounds from standard deviations.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/log.hpp"
#include "identify/noise_level.hpp"
#include "model/filter/measurement.hpp"

namespace wheelwright::inference {

/// By which columns standstill is recognised. Commands, where there are any, must be zero; and the motion, where there
/// is any, must rest too: a robot that coasts or is pushed does not stand still.
struct StandstillSigns {
  std::vector<std::string> commands;  ///< commanded speeds of all joints
  std::vector<std::string> speeds;    ///< measured speeds of all joints
  std::vector<std::string> angles;    ///< measured angles of all joints; looked at where there are no speeds
};

/// The signs that `log` has for `model`: each list only where the columns of all joints are there.
[[nodiscard]] StandstillSigns standstill_signs(const LogSource& log, const Model& model);

/// Criteria for standstill.
struct StandstillOptions {
  double least_time = 1.0;  ///< s, of a stretch after trimming
  double trim = 0.5;        ///< s, left out at both ends of a stretch: coasting, and torque that rises before motion
  double near = 0.05;       ///< of the joint's largest speed in the log: every measured speed in a stretch is below
  double slow = 0.005;      ///< of the same: the mean speed of each half of a stretch is below, so slow creeping is
                            ///< told from noise about zero
  double piece = 60.0;      ///< s: longer stretches are cut, so slow drift of an offset is not taken for noise
  identify::ExtrapolationOptions extrapolation;  ///< of the bounds
};

/// One column at standstill.
struct StandstillNoise {
  /// What the column shows.
  enum class Kind {
    not_seen,  ///< the log has no standstill: all numbers are 0
    constant,  ///< never changes within a stretch. An encoder at rest does not: its rounding shows in motion only, so
               ///< that nothing about its noise follows
    noisy,     ///< changes
  };
  Kind kind = Kind::not_seen;
  double offset = 0.0;                ///< mean over all stretches, unit of the column
  double offset_spread = 0.0;         ///< standard deviation of the stretches' means; 0 for a single one
  double sd = 0.0;                    ///< within the stretches, about their means
  double relative_sd = 0.0;           ///< standard error of sd², relative to it, allowing for autocorrelation
  double correlation = 0.0;           ///< between neighbouring samples
  double largest = 0.0;               ///< largest deviation from a stretch's mean
  identify::ExtrapolatedBound bound;  ///< on the deviation, extrapolated over the horizon as noise_level.hpp says
};

/// The noise levels of the columns, and the stretches of standstill that they come from.
struct Standstill {
  std::vector<StandstillNoise> columns;  ///< in the order that was asked
  std::size_t stretches = 0;
  std::size_t samples = 0;
  double seconds = 0.0;    ///< of standstill, after trimming
  std::string recognised;  ///< how, e.g. "commands at zero, speeds near zero for 1 s"; why not where there is none
};

/// Noise of each of `columns` at standstill, two walks; no more than one piece is held in memory.
///
/// Assumes that the noise of the robot in motion is that of the robot at rest. For efforts and inertial sensors this is
/// a lower limit (no switching currents, no vibration); for encoders it is meaningless (Kind::constant, or a count that
/// flickers). Throws InvalidArgument when a column is missing, no sign is given, or an option is not positive.
[[nodiscard]] Standstill standstill_noise(LogSource& log, const StandstillSigns& signs,
                                          const std::vector<std::string>& columns,
                                          const StandstillOptions& options = {});

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
  ErrorBound bound;          ///< for the feasible sets
  std::string assumption;    ///< what the level assumes, e.g. "noise independent from sample to sample"
  std::string reason;        ///< one sentence: why this one
};

/// Differences where they look white, because they are of the sensor in motion; unless standstill is larger by three
/// standard errors, since differences do not see correlated noise. Then standstill, as a lower limit; then rough
/// differences, as an upper limit. Smooth differences are never used: they may be wrong either way. The bound is made
/// for `options`; where standstill is used, it is no less than the one extrapolated there.
[[nodiscard]] NoiseChoice choose_noise(const NoiseEvidence& evidence, const ErrorBoundOptions& options = {});

}  // namespace wheelwright::inference

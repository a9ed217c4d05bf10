// SPDX-License-Identifier: Apache-2.0
/// \file
/// Noise levels of the columns of two logs that were driven by the same commands.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <wheelwright/core/log.hpp>

namespace wheelwright {

/// Alignment of two runs.
struct RepeatOptions {
  std::vector<std::string> commands;  ///< columns that both runs share; empty: runs are aligned by the time since their
                                      ///< start
  double most_shift = 2.0;            ///< s, by which commands may begin earlier or later in the second run
  double most_mismatch = 0.02;        ///< rms difference of the commands, of their own spread about the mean
  double least_agreement = 0.9;       ///< without commands: share of the variance of the best column that repeats
  std::size_t lags = 20;              ///< of the autocorrelation
};

/// One column of two runs.
struct RepeatNoise {
  double offset = 0.0;       ///< mean difference, second run less first, unit of the column
  double sd = 0.0;           ///< of one run: root of half the variance of the difference about its mean
  double relative_sd = 0.0;  ///< standard error of sd², relative to it, allowing for autocorrelation
  double largest = 0.0;      ///< largest difference about its mean
  double agreement = 0.0;    ///< 1 − sd²/variance of the column: 1 where all of it repeats, 0 where nothing does
  std::vector<double> autocorrelation;  ///< of the difference, at 1, 2, … median steps
  double correlation_time = 0.0;  ///< s, at which the autocorrelation has fallen below 1/e (the last lag where it has
                                  ///< not)
};

/// Verdict: the runs are repeats or not.
enum class RepeatStatus {
  repeats,             ///< numbers can be used
  different_commands,  ///< the commands differ at every shift: the numbers are no noise
  different_motion,    ///< without commands to look at, no column repeats: the numbers are no noise
  too_short,           ///< fewer than 50 instants in common; no numbers
};

/// The two runs.
struct Repeats {
  RepeatStatus status = RepeatStatus::too_short;
  double shift = 0.0;     ///< s: the second run's clock, from its start, is ahead of the first's by this
  double mismatch = 0.0;  ///< of the commands at that shift, of their spread; 0 without commands
  std::size_t instants = 0;
  std::vector<RepeatNoise> columns;  ///< in the order that was asked; empty where too short
};

/// Noise of each of `columns` from the difference of two runs. Both logs are held in memory.
///
/// The second run is interpolated linearly at the instants of the first, inside one segment and no gap of 1.5 steps; a
/// share w of the next sample leaves noise of variance (w² + (1 − w)²)σ², so each squared difference is divided by
/// 1 + w² + (1 − w)²: unbiased for noise that is independent from sample to sample.
///
/// Assumes that everything but the sensors repeats. What does not (ground, battery, temperature, feedback from noise)
/// is counted as noise: `sd` is an upper limit, and close only where `autocorrelation` is near zero, as sensors' noise
/// mostly is and driving is not. Throws InvalidArgument when a column is missing or an option is out of range.
[[nodiscard]] Repeats repeat_noise(LogSource& first, LogSource& second, const std::vector<std::string>& columns,
                                   const RepeatOptions& options = {});

}  // namespace wheelwright

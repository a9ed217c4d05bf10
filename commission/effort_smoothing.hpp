// SPDX-License-Identifier: Apache-2.0
/// \file
/// Efforts that are late since a low-pass filter smoothed them.
#pragma once

#include <cstddef>
#include <optional>

#include "commission/fit.hpp"
#include "commission/setting.hpp"
#include "core/log.hpp"

namespace wheelwright::commission {

/// Logged efforts as those of the wheels behind a first-order low-pass filter, T ẏ + y = Yθ. A shift by T looks the
/// same to slow motion, and noise of the motion, which such a filter takes away, hides the difference: what is told is
/// the time constant, not which of the two it is.
struct EffortSmoothing {
  double time_constant = 0.0;  ///< s, T
  double error = 0.0;          ///< s, half of a 95 % interval: two standard errors, and half a step, by which filters
                               ///< that are computed from sample to sample differ
};

/// The filter that explains the first `most_rows` rows of `log` best, of `longest` s at most. Nothing where no time
/// constant is told (none is needed, at the end of what is searched, segments too short, unsigned efforts).
[[nodiscard]] std::optional<EffortSmoothing> effort_smoothing(LogSource& log, const Setting& setting, const Fit& fit,
                                                              double longest = 0.2, std::size_t most_rows = 60000);

}  // namespace wheelwright::commission

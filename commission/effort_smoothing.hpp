// SPDX-License-Identifier: Apache-2.0
/// \file
/// Late efforts: shifted, or smoothed by a low-pass filter.
#pragma once

#include <cstddef>
#include <optional>

#include "commission/fit.hpp"
#include "commission/setting.hpp"
#include "core/log.hpp"

namespace wheelwright::commission {

/// Logged efforts as those of the wheels behind a first-order low-pass filter, T ẏ + y = Yθ, against a constant shift.
struct EffortSmoothing {
  double time_constant = 0.0;   ///< s, T
  double standard_error = 0.0;  ///< s, valid under autocorrelated residuals
  double freedom = 1.0;         ///< degrees of freedom of its Student's t
  /// How much better the filter explains the rows than the best shift: the sum of the differences of their squared
  /// residuals as a multiple of what is certain at a risk of 0.1 %. Above 1 it is a filter, below −1 a shift; between
  /// them the log does not tell.
  double preference = 0.0;
};

/// The filter that explains the first `most_rows` rows of `log` best, of `longest` s at most, compared with the shift
/// `delay` (s, > 0) that does. Nothing where no time constant is told (none is needed, at the end of what is searched,
/// segments too short, unsigned efforts).
[[nodiscard]] std::optional<EffortSmoothing> effort_smoothing(LogSource& log, const Setting& setting, const Fit& fit,
                                                              double delay, double longest = 0.2,
                                                              std::size_t most_rows = 60000);

}  // namespace wheelwright::commission

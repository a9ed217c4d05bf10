// SPDX-License-Identifier: Apache-2.0
/// \file
/// Efforts that a low-pass filter smoothed before they were logged, found from the equation of motion.
#pragma once

#include <cstddef>
#include <optional>

#include "commission/fit.hpp"
#include "commission/setting.hpp"
#include "core/interval.hpp"
#include "core/log.hpp"

namespace wheelwright::commission {

/// Logged efforts y as those of the wheels, u, behind y_k = y_{k−1} + (u_k − y_{k−1})/(1 + κ). With u_k = y_k + κ(y_k −
/// y_{k−1}) the equation of motion is linear in κ, too. To slow motion such efforts look late by κ steps.
struct EffortSmoothing {
  double sharpening = 0.0;      ///< κ
  double standard_error = 0.0;  ///< of it, valid under autocorrelated residuals
  double freedom = 1.0;         ///< degrees of freedom of its Student's t
  double moved = 0.0;           ///< largest change of a parameter from κ = 0 to this κ, in its standard errors

  /// Time constant T of the filter with this κ at steps of `step` (s): κ = 1/(e^{h/T} − 1). 0 for κ <= 0.
  [[nodiscard]] static double time_constant(double sharpening, double step);
};

/// κ by weighted least squares on the first `most_rows` rows of `log`, with dry friction as a further unknown where the
/// robot may have it; rows in which noise leaves the sign of a speed open are left out. Nothing where too few rows are
/// left, or efforts have no sign or are corrected.
[[nodiscard]] std::optional<EffortSmoothing> effort_smoothing(LogSource& log, const Setting& setting, const Fit& fit,
                                                              std::size_t most_rows = 60000);

/// What makes efforts late.
enum class EffortLag {
  delay,   ///< a constant shift
  filter,  ///< a low-pass filter (EffortSmoothing)
  either,  ///< the log does not tell
};

/// Which of the two leaves less of the first `most_rows` rows of `log`, the shift by `delay` (s, > 0) or the best
/// filter, told at a risk of 1e-4 by the sum of the differences of squared residuals (Vuong 1989).
[[nodiscard]] EffortLag effort_lag(LogSource& log, const Setting& setting, const Fit& fit, double delay,
                                   std::size_t most_rows = 60000);

}  // namespace wheelwright::commission

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Low-pass filter that speeds, but not efforts, passed through before they were logged, found from the two.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include "commission/contradictions.hpp"
#include "commission/fit.hpp"
#include "commission/setting.hpp"
#include "core/log.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {

/// What makes efforts early against speeds. Speeds that a driver smooths and an actuator that is slow to follow give
/// one and the same equation: which of the two it is efforts and speeds cannot tell, and parameters do not depend on
/// it.
struct SpeedSmoothing {
  model::SpeedFilter filter;    ///< found, with the interval that holds the time constant at a risk of 1e-4; the number
                                ///< of rows of a mean is exact where the interval holds one whole number
  double time = 0.0;            ///< s, best value
  double standard_error = 0.0;  ///< s, valid under autocorrelated residuals
  double delay = 0.0;           ///< s, the constant shift that explains the log best instead (> 0: efforts are early)
  double steps = 0.0;           ///< `delay` in steps of the log
  double differs = 0.0;         ///< largest share by which a parameter is another with the shift
  bool told = false;  ///< the log tells the filter from any shift, at a risk of 1e-4; else a mean stands for both
  bool gyro_agrees = false;   ///< the wheels' yaw rate follows the gyro as late as the efforts
  bool dry_friction = false;  ///< the log shows dry friction too, whose sign does not pass through a filter
};

/// The filter that explains best why the efforts of the first `most_rows` rows of `log` are early, with dry friction as
/// a further unknown; nothing where none is found (a constant shift explains it, rows too few, efforts unsigned or
/// corrected, motion from angles). Every candidate is y = (1 + c₁D + c₂D² + c₃D³) Yθ with the coefficients of its
/// inverse transfer function; both sides pass through one further low-pass filter of third order, so that D is no
/// difference and residuals compare.
[[nodiscard]] std::optional<SpeedSmoothing> speed_smoothing(LogSource& log, const Setting& setting, const Fit& fit,
                                                            std::size_t most_rows = 30000);

/// The line of a robot file that declares `filter`.
[[nodiscard]] std::string declaration(const model::SpeedFilter& filter);

/// speed_smoothing() where `timing` says that efforts are early: by about half a step, by which held ones are that are
/// read as measured, only where a filter is told from that.
[[nodiscard]] std::optional<SpeedSmoothing> smoothing_behind(LogSource& log, const Setting& setting, const Fit& fit,
                                                             const EffortTiming& timing);

/// What was found, with its numbers, and what to do about it: sentences without a full stop.
[[nodiscard]] std::string late_speeds(const SpeedSmoothing& smoothing);
[[nodiscard]] std::string way_out(const SpeedSmoothing& smoothing);

}  // namespace wheelwright::commission

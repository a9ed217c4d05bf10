// SPDX-License-Identifier: Apache-2.0
/// \file
/// Error classes of efforts from a log, where the robot file leaves them to be estimated.
#pragma once

#include <optional>

#include "core/log.hpp"
#include "detector/learnt_model.hpp"
#include "model/filter/error_class.hpp"

namespace wheelwright::commission {

/// Deviation of the efforts' errors by weighted sums of what `model` leaves on `log` (ScaleDetector): over each scale
/// the root of Σ S²/V, V a sum's variance for errors of variance 1. The smallest of all scales that the log holds often
/// enough: over shorter ones the angles' errors stand in it, over longer ones what drifts. Unit of the effort. The
/// motion column's error is at most `motion`. Nothing where the log is too short, or holds no motion.
[[nodiscard]] std::optional<double> effort_deviation(LogSource& log, const OnlineModel& model, double motion);

/// Classes of errors that average out, up to the bias: the motion column's error as declared or as its encoder makes
/// it, the efforts' deviation a tenth above effort_deviation(), their bound three of these. Nothing where either is not
/// known.
[[nodiscard]] std::optional<filter::ErrorClasses> estimated_classes(LogSource& log, const OnlineModel& model);

}  // namespace wheelwright::commission

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Efforts that are no efforts of the wheel they are logged for: stretches in which they stand still, copies.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "commission/doctor/log_health.hpp"
#include "core/log.hpp"

namespace wheelwright::doctor {

/// Rows [first, last) of one segment that hold exactly one value.
struct ValueRun {
  std::size_t first = 0, last = 0;
  double value = 0.0;
  [[nodiscard]] std::size_t rows() const { return last - first; }
};

/// `column` of the log in `view` as runs of equal values, in the order of its rows.
[[nodiscard]] std::vector<ValueRun> value_runs(const HealthView& view, const std::vector<double>& column);

/// The stretches of `finding` as arguments of `convert`: " --without 60:61.98 …".
[[nodiscard]] std::string without_arguments(const LogFinding& finding);

/// True if the robot moves in at least half of the rows of `run`.
[[nodiscard]] bool mostly_moves(const HealthView& view, const ValueRun& run);

/// Finds stretches of 0.3 s and more in which an effort keeps one value to all digits, although it is new every few
/// rows elsewhere, and in which the robot moves as no such effort explains: signals.effort_frozen. What explains motion
/// is the model with all its parameters, fitted to the rest of the log; a stretch is frozen where the mean square of
/// its residual is four times that of the worst stretch of its length in the rest, and material beside the efforts.
/// Coasting, standstill, limits and steps of a command are explained, and are none. Returns the log without these
/// stretches where there are any, for the checks that come after. Needs motion and efforts.
[[nodiscard]] std::optional<LogTable> check_frozen_efforts(const HealthView& view, std::vector<LogFinding>& findings);

/// Tells two efforts of which one is a multiple of the other in all rows although their wheels move differently:
/// signals.effort_copied.
void check_copied_efforts(const HealthView& view, std::vector<LogFinding>& findings);

}  // namespace wheelwright::doctor

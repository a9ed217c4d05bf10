// SPDX-License-Identifier: Apache-2.0
/// \file
/// Residual and thresholds over time, for other programs to plot.
#pragma once

#include <filesystem>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/core/log.hpp>
#include <wheelwright/detector/detector.hpp>

namespace wheelwright::app {

/// Walks `log` with the detector of `model` and writes, for every instant at which it decides and each output, the
/// columns residual_OUTPUT, lower_OUTPUT, upper_OUTPUT, rho_OUTPUT, outside_OUTPUT and alarm_OUTPUT (0 or 1), in the
/// format that the ending of `path` says (create_log); in a bag they are on the topic /residual. `origin` is
/// LogFileReport::time_origin. Throws InputError as create_log does.
void write_series(const std::filesystem::path& path, LogSource& log, const OnlineModel& model,
                  const detector::DetectorOptions& options, double origin);

}  // namespace wheelwright::app

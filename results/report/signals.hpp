// SPDX-License-Identifier: Apache-2.0
/// \file
/// Charts of the measured signals, and of the residuals, thresholds and decisions of the detector.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "commission/detection.hpp"
#include "core/log.hpp"
#include "model/robot.hpp"
#include "results/report/page.hpp"

namespace wheelwright::report {

/// The rows of `log` where these are `most` or fewer; else the smallest and the largest value of every column in each
/// bin of consecutive rows, as two rows (one where a bin has a single row): at most `most` of them unless nearly every
/// row starts a segment. Walks the log once, and holds 8 bytes a value of what it hands out.
[[nodiscard]] LogTable raw_signals(LogSource& log, std::size_t most = most_chart_points);

/// A point-wise smaller table that looks the same: of each bin of rows the smallest and largest value of every column,
/// in the order in which they occurred. At most about `most` rows; bins do not cross segments. Tables that are short
/// enough come back as they are.
[[nodiscard]] LogTable thinned(const LogTable& table, std::size_t most);

/// Charts of the raw signals, grouped by kind (wheel speeds, angles, efforts, commands, pose, IMU, single axis,
/// others), each with `marks`. `rows`: of the log, where `signals` was thinned before. HTML; a sentence where there are
/// none.
[[nodiscard]] std::string signal_charts(const LogTable& signals, const std::vector<ChartMark>& marks,
                                        const TimeAxis& axis, std::size_t rows = 0);

/// The residual of each output inside [l, u], with the marks of that output. `clock` becomes the id of the trace's
/// times.
[[nodiscard]] std::string residual_charts(const commission::Trace& trace, const Robot& robot, const Model& model,
                                          const std::vector<std::vector<ChartMark>>& marks, const TimeAxis& axis,
                                          const std::string& clock);

/// Filtered torque, measured against predicted, for each output. residual_charts() put its times on the page as
/// `clock`.
[[nodiscard]] std::string torque_charts(const commission::Trace& trace, const Robot& robot, const Model& model,
                                        const TimeAxis& axis, const std::string& clock);

/// A note that `all` things were drawn as `drawn` points; empty where none is missing. HTML.
[[nodiscard]] std::string thinning_note(std::size_t all, std::size_t drawn, const char* what);

}  // namespace wheelwright::report

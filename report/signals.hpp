// SPDX-License-Identifier: Apache-2.0
/// \file
/// Charts of what was measured and of what the detector made of it.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/commission/trace.hpp>
#include <wheelwright/core/log.hpp>
#include <wheelwright/model/robot.hpp>
#include <wheelwright/report/chart.hpp>

namespace wheelwright::report {

/// A point-wise smaller table that looks the same: of each bin of rows the smallest and largest value of every column, in
/// the order in which they occurred. At most about `most` rows; bins do not cross segments. Tables that are short enough
/// come back as they are.
[[nodiscard]] LogTable thinned(const LogTable& table, std::size_t most);

/// Charts of the raw signals, grouped by kind (wheel speeds, angles, efforts, commands, pose, IMU, single axis, others),
/// each with `marks`. HTML; a sentence where there are none.
[[nodiscard]] std::string signal_charts(const LogTable& signals, const std::vector<ChartMark>& marks,
                                        const TimeAxis& axis);

/// The residual of each output inside [l, u], with the marks of that output.
[[nodiscard]] std::string residual_charts(const Trace& trace, const Robot& robot, const Model& model,
                                          const std::vector<std::vector<ChartMark>>& marks, const TimeAxis& axis);

/// Filtered torque, measured against predicted, for each output.
[[nodiscard]] std::string torque_charts(const Trace& trace, const Robot& robot, const Model& model,
                                        const TimeAxis& axis);

}  // namespace wheelwright::report

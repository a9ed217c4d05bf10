// SPDX-License-Identifier: Apache-2.0
/// \file
/// Drawings of an identification, as SVG.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/inference/identification.hpp>
#include <wheelwright/report/time_axis.hpp>

namespace wheelwright::report {

/// One row of bars for each parameter (`names`, text): the share of its information in each window of the log, the
/// fewest windows that carry most of it filled. Over log time; over windows in their order where the log's time goes
/// back. Empty without windows or where no parameter has information.
[[nodiscard]] std::string information_bars(const InformationOverTime& information,
                                           const std::vector<std::string>& names, const TimeAxis& axis);

/// The residual with a shape held at each value over the residual without it, the best one marked; empty for fewer than
/// two points.
[[nodiscard]] std::string shape_curve(const ShapeFinding& shape);

}  // namespace wheelwright::report

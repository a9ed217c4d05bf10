// SPDX-License-Identifier: Apache-2.0
/// \file
/// The table of parameters: estimates, intervals, and what sets each bound.
#pragma once

#include <string>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/report/time_axis.hpp>

namespace wheelwright::report {

/// The table (HTML), its legend and remarks; empty where there is no parameter. Two rows for each parameter: the physical
/// quantity, where the robot file tells the scale, and θ_L. Bounds are printed rounded outward.
[[nodiscard]] std::string parameter_table(const Commissioning& result, const TimeAxis& axis);

}  // namespace wheelwright::report

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Tables of parameters and estimators.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/words/parameter_view.hpp>
#include <wheelwright/words/time_axis.hpp>

namespace wheelwright::report {

/// Reason, Durbin-Wu-Hausman test and a table of all candidates with their 95 % intervals, as HTML; empty where nothing
/// was estimated.
[[nodiscard]] std::string estimator_table(const Commissioning& result);

/// The table (HTML), its legend and remarks; empty where there is no parameter. Two rows for each parameter: the
/// physical quantity, where the robot file tells the scale, and θ_L. Bounds are printed rounded outward.
[[nodiscard]] std::string parameter_table(const Commissioning& result, const words::TimeAxis& axis);

}  // namespace wheelwright::report

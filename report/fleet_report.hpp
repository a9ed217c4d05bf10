// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of a fleet.
#pragma once

#include <string>

#include <wheelwright/report/context.hpp>
#include <wheelwright/study/fleet_result.hpp>

namespace wheelwright {

/// One self-contained HTML page: the fleet in words, the population of each parameter, robots outside, drifting, with alarms or
/// failed, thresholds and pooled prior. Tables list at most 500 rows and say how many there are; the page of 3,000 robots stays
/// below a megabyte.
[[nodiscard]] std::string fleet_report(const FleetResult& fleet, const ReportContext& context);

}  // namespace wheelwright

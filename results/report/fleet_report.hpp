// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of a fleet, and its drawings as SVG, which stay small for any number of robots.
#pragma once

#include <cstddef>
#include <string>

#include "results/report/page.hpp"
#include "study/fleet_result.hpp"

namespace wheelwright::report {

/// All robots' intervals of bounds of parameter number `parameter` of the population, sorted by estimate, with the
/// population's centre and its ± 2 spreads as a band, and the robots outside marked. Up to 400 robots each have an
/// interval of their own; of more, each of 400 columns shows the envelope of its robots' bounds and estimates, and
/// robots outside stay marked. The scale is that of the estimates: bounds may run beyond it. Empty where no robot shows
/// the parameter.
[[nodiscard]] std::string fleet_strip(const study::FleetResult& fleet, std::size_t parameter);

/// The logs over time of a robot that drifts are not kept: this draws the slopes of all robots and of those that drift,
/// as intervals, worst first, at most `most` of them. Empty where there is none with a trend in `column`.
[[nodiscard]] std::string slope_strip(const study::FleetResult& fleet, std::size_t column, std::size_t most = 60);

/// One self-contained HTML page: the fleet in words, the population of each parameter, robots outside, drifting, with
/// alarms or failed, thresholds and pooled prior. Tables list at most 500 rows and say how many there are; the page of
/// 3,000 robots stays below a megabyte.
[[nodiscard]] std::string fleet_report(const study::FleetResult& fleet, const ReportContext& context);

}  // namespace wheelwright::report

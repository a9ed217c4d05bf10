// SPDX-License-Identifier: Apache-2.0
/// \file
/// A log thinned to what a page can draw.
#pragma once

#include <cstddef>

#include <wheelwright/core/log.hpp>
#include <wheelwright/report/chart.hpp>

namespace wheelwright::report {

/// The rows of `log` where these are `most` or fewer; else the smallest and the largest value of every column in each bin
/// of consecutive rows, as two rows (one where a bin has a single row): at most `most` of them unless nearly every row
/// starts a segment. Walks the log once, and holds 8 bytes a value of what it hands out.
[[nodiscard]] LogTable raw_signals(LogSource& log, std::size_t most = most_chart_points);

}  // namespace wheelwright::report

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The tables of a commissioning report below the charts. All functions return HTML.
#pragma once

#include <string>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/report/context.hpp>
#include <wheelwright/report/time_axis.hpp>

namespace wheelwright::report {

/// What happened on held-out blocks, one row for each output, with what the numbers mean.
[[nodiscard]] std::string validation_section(const Commissioning& result);

/// Where each noise bound comes from.
[[nodiscard]] std::string noise_section(const Commissioning& result);

/// Filter constants, delay, and the curve behind the choice.
[[nodiscard]] std::string filter_section(const Commissioning& result);

/// The rows that contradict each other, where the feasible set is empty; else empty.
[[nodiscard]] std::string contradiction_section(const Commissioning& result, const TimeAxis& axis);

/// Files, rows, segments, steps, repairs and notes.
[[nodiscard]] std::string data_section(const Commissioning& result, const ReportContext& context, const TimeAxis& axis);

}  // namespace wheelwright::report

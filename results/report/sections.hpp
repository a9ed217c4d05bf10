// SPDX-License-Identifier: Apache-2.0
/// \file
/// Sections of a commissioning report: tables of parameters and estimators, tables below the charts, assumptions and
/// their warrant. All functions return HTML.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "commission/assumptions.hpp"
#include "commission/commission.hpp"
#include "results/report/page.hpp"
#include "results/words/commission_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::report {

/// Reason, Durbin-Wu-Hausman test and a table of all candidates with their 95 % intervals, as HTML; empty where nothing
/// was estimated.
[[nodiscard]] std::string estimator_table(const Commissioning& result);

/// The table (HTML), its legend and remarks; empty where there is no parameter. Two rows for each parameter: the
/// physical quantity, where the robot file tells the scale, and θ_L. Bounds are printed rounded outward.
[[nodiscard]] std::string parameter_table(const Commissioning& result, const words::TimeAxis& axis);

/// Validation on held-out blocks, one row for each output, with the meaning of the numbers.
[[nodiscard]] std::string validation_section(const Commissioning& result);

/// Where each noise bound comes from.
[[nodiscard]] std::string noise_section(const Commissioning& result);

/// Filter constants, delay, and the curve behind the choice.
[[nodiscard]] std::string filter_section(const Commissioning& result);

/// The rows that contradict each other, where the feasible set is empty; else empty.
[[nodiscard]] std::string contradiction_section(const Commissioning& result, const TimeAxis& axis);

/// Files, rows, segments, steps, repairs and notes.
[[nodiscard]] std::string data_section(const Commissioning& result, const ReportContext& context, const TimeAxis& axis);

/// The word as a badge, of another colour for each. HTML.
[[nodiscard]] std::string warrant_badge(core::Warrant warrant);

/// The badge and what the word means, as a paragraph. HTML.
[[nodiscard]] std::string warrant_note(core::Warrant warrant);

/// The assumptions with their verdicts, those that fail first, as a table; empty for none. HTML.
[[nodiscard]] std::string assumptions_section(const std::vector<core::Assumption>& assumptions);

/// The charts of the raw signals of `context` with `marks`, or that they were not handed to the page.
[[nodiscard]] std::string signals_section(const ReportContext& context, const std::vector<ChartMark>& marks,
                                          const TimeAxis& axis);

}  // namespace wheelwright::report

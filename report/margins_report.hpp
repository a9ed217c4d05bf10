// SPDX-License-Identifier: Apache-2.0
/// \file
/// The report of `wheelwright margins`.
#pragma once

#include <string>

#include <wheelwright/commission/margin_survey.hpp>
#include <wheelwright/report/context.hpp>

namespace wheelwright {

/// One self-contained page: what is certainly seen, in words, as a table by manoeuvre, as curves of size over delay, and
/// as maps over the operating space.
[[nodiscard]] std::string margins_report(const MarginSurvey& survey, const CommissionedModel& model,
                                         const ReportContext& context);

}  // namespace wheelwright

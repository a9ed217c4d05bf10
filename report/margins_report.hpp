// SPDX-License-Identifier: Apache-2.0
/// \file
/// The report of `wheelwright margins`, and its drawings as SVG.
#pragma once

#include <string>

#include <wheelwright/commission/margin_survey.hpp>
#include <wheelwright/report/context.hpp>

namespace wheelwright::report {

/// Smallest certain size over the delay, both logarithmic: for each manoeuvre the median over its onsets, and the size
/// that is certain at every one of them (thin). Empty where nothing is certain.
[[nodiscard]] std::string delay_curves(const detector::FaultMargins& margins, const commission::MarginSurvey& survey);

/// The same for both guarantees: medians over all onsets of the drive, for every noise within its bounds, and at the
/// stated risk. `margins` are MarginSurvey::at_risk's.
[[nodiscard]] std::string risk_curves(const detector::FaultMargins& margins, const commission::MarginSurvey& survey);

/// A map over the operating space: the darker a point, the smaller the certain size, on a logarithmic scale whose ends
/// are written out; empty points show no certain size. Empty where no point has one.
[[nodiscard]] std::string margin_map(const detector::OperatingMap& map, const detector::FaultType& fault,
                                     const std::string& x_label, const std::string& y_label);

/// One self-contained page: what is certainly seen, in words, as a table by manoeuvre, as curves of size over delay,
/// and as maps over the operating space.
[[nodiscard]] std::string margins_report(const commission::MarginSurvey& survey, const OnlineModel& model,
                                         const ReportContext& context);

}  // namespace wheelwright::report

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The pages of a detection and of margins, and their drawings as SVG.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "commission/detection.hpp"
#include "commission/margin_survey.hpp"
#include "commission/watch/risk_watch.hpp"
#include "detector/faults/isolation.hpp"
#include "detector/faults/margins.hpp"
#include "detector/incidents.hpp"
#include "detector/learnt_model.hpp"
#include "results/report/page.hpp"

namespace wheelwright::commission {
struct OtherParameters;
}  // namespace wheelwright::commission

namespace wheelwright::report {

/// Findings of the kinematic residual.
struct KinematicFindings {
  std::optional<Detection> detection{};  ///< nothing where it was not watched
  std::string message{};                 ///< why not
};

/// One self-contained HTML page: what the detector says in words, its events (a click zooms all charts to one), the
/// residual inside [l, u] with the events shaded, prediction, raw signals, data, and the same of
/// the kinematic residual. `at_risk` is the same log under the detector at a stated risk. `isolations` belong to the
/// first events, in their order; `incidents` join all events and stand first. It loads nothing when opened; every name
/// is escaped, every number is finite. `undecided` says why the log as a whole was not decided on; empty where it was.
/// `other` parameters that explain the whole log stand before the incidents; null where there are none.
[[nodiscard]] std::string detect_report(const Detection& detection, const OnlineModel& model,
                                        const ReportContext& context, const KinematicFindings& kinematic = {},
                                        const std::vector<detector::Isolation>& isolations = {},
                                        const commission::RiskWatch& at_risk = {},
                                        const std::vector<detector::Incident>& incidents = {},
                                        const std::string& undecided = {},
                                        const commission::OtherParameters* other = nullptr);

/// What is known of the size of a fault over time: the band of one that only grows, and the intervals of weighted means
/// of one of any course as bars over what they are means of; from `start` on the robot was not healthy. Empty where
/// nothing is known.
[[nodiscard]] std::string size_band(const detector::SizeOverTime& size, double start);

/// Smallest certain size over the delay, both logarithmic: for each manoeuvre the median over its onsets, and the size
/// that is certain at every one of them (thin). Empty where nothing is certain.
[[nodiscard]] std::string delay_curves(const detector::FaultMargins& margins, const commission::MarginSurvey& survey);

/// The same for both guarantees: medians over all onsets of the drive, for every noise within its bounds, and at the
/// stated risk. `margins` are MarginSurvey::at_risk's.
[[nodiscard]] std::string risk_curves(const detector::FaultMargins& margins, const commission::MarginSurvey& survey);

/// A map over the operating space: the darker a point, the smaller the certain size, on a logarithmic scale whose ends
/// are written out; empty points show no certain size. Empty where no point has one.
[[nodiscard]] std::string margin_map(const detector::OperatingMap& map, const model::FaultType& fault,
                                     const std::string& x_label, const std::string& y_label);

/// One self-contained page: what is certainly seen, in words, as a table by manoeuvre, as curves of size over delay,
/// and as maps over the operating space.
[[nodiscard]] std::string margins_report(const commission::MarginSurvey& survey, const OnlineModel& model,
                                         const ReportContext& context);

}  // namespace wheelwright::report

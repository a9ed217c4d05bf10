// SPDX-License-Identifier: Apache-2.0
/// \file
/// Detections and margins in plain sentences.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include <wheelwright/commission/detector_walk.hpp>
#include <wheelwright/commission/margin_survey.hpp>
#include <wheelwright/words/text.hpp>

namespace wheelwright::words {

/// One short sentence; `kinematic_events` are those of the kinematic residual. Text, not HTML.
[[nodiscard]] std::string detect_verdict(const Detection& detection, std::size_t kinematic_events);

/// The residuals that were checked; where there are events: the first and the clearest one, how much of the driving
/// contradicts the fault-free model, what this means, and the faults of the catalogue that remain possible for the
/// first event. Text, not HTML.
[[nodiscard]] std::vector<std::string> detect_words(const Detection& detection, const OnlineModel& model,
                                                    const std::vector<detector::Isolation>& isolations,
                                                    const TimeAxis& axis);

/// A magnitude of a fault: a share as a percentage ("4.1 %"), else with its unit; "–" where it is infinite.
[[nodiscard]] std::string magnitude_words(const model::FaultType& fault, double magnitude);

/// Smallest certain size in one manoeuvre within window number `window`, in words: "4.1 %" at every onset of it in the
/// drive, "4.1 % at 5 of 7" onsets, "–" at none; of a fault without a size "yes", "at 3 of 7" or "–". Empty where the
/// drive has no such onset.
[[nodiscard]] std::string certain_words(const detector::FaultMargins& margins, std::size_t window,
                                        detector::ManoeuvreKind kind);

/// The window that tables show: the longest one up to a second.
[[nodiscard]] std::size_t shown_window(const commission::MarginSurvey& survey);

/// In which sense a size is called certain, one sentence.
[[nodiscard]] std::string certain_meaning(core::Warrant warrant);

/// One fault on one side under both guarantees: the smallest certain size within each of kRiskWindows, median over
/// onsets.
struct RiskSizes {
  std::string fault;                    ///< "wheel radius (+)"
  std::vector<std::string> worst_case;  ///< for every noise within its bounds, the better of the residuals
  std::vector<std::string> at_risk;     ///< at the stated risk, by sums over scales
};

/// s, of RiskSizes.
inline constexpr std::array<double, 3> kRiskWindows = {1.0, 5.0, 20.0};

/// Of every fault that has a certain size at the stated risk; nothing where the survey says nothing at a risk.
[[nodiscard]] std::vector<RiskSizes> risk_sizes(const commission::MarginSurvey& survey);

/// In which sense a size is called certain at the stated risk, one sentence.
[[nodiscard]] std::string risk_meaning(const commission::RiskMargins& margins);

/// A sentence or two for each fault and side: in which manoeuvres it is certainly seen, from what size on, how soon, by
/// which residual, and in which it is not certain.
[[nodiscard]] std::vector<std::string> margin_sentences(const commission::MarginSurvey& survey);

}  // namespace wheelwright::words

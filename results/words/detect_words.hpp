// SPDX-License-Identifier: Apache-2.0
/// \file
/// Detections and margins in plain sentences.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "commission/detection.hpp"
#include "commission/margin_survey.hpp"
#include "detector/faults/isolation.hpp"
#include "detector/faults/margins.hpp"
#include "detector/incidents.hpp"
#include "detector/learnt_model.hpp"
#include "results/words/text.hpp"

namespace wheelwright::commission {
struct DetectorChoice;
}  // namespace wheelwright::commission

namespace wheelwright::words {

/// One short sentence; `kinematic_events` are those of the kinematic residual, and `undecided` whether the log as a
/// whole was not decided on (why_not_decided()). Text, not HTML.
[[nodiscard]] std::string detect_verdict(const Detection& detection, std::size_t kinematic_events,
                                         bool undecided = false);

/// The residuals that were checked; where there are events: the first and the clearest one, how much of the driving
/// contradicts the fault-free model, what this means, and the faults of the catalogue that remain possible for the
/// first event. Text, not HTML.
[[nodiscard]] std::vector<std::string> detect_words(const Detection& detection, const OnlineModel& model,
                                                    const std::vector<detector::Isolation>& isolations,
                                                    const TimeAxis& axis);

/// An incident in one sentence: the likeliest fault with size and onset, what else is possible, how many events it
/// joins. Text, not HTML.
[[nodiscard]] std::string incident_sentence(const detector::Incident& incident);

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

/// Smallest certain sizes of one fault over the time to detection, the larger of its sides, median over onsets: (s,
/// size), ascending, as far as there is one.
struct DetectionCurve {
  model::FaultType fault;
  std::vector<std::pair<double, double>> every_noise;  ///< for every noise within its bounds, the better residual's
  std::vector<std::pair<double, double>> at_risk;      ///< at the stated risk

  /// The size that is certain within `within` s; infinite where there is none.
  [[nodiscard]] static double size_within(const std::vector<std::pair<double, double>>& curve, double within);
};

/// Those of the faults `names`, as far as the survey has them; of its first faults where it has none of these.
[[nodiscard]] std::vector<DetectionCurve> detection_curves(const commission::MarginSurvey& survey,
                                                           const std::vector<std::string>& names);

/// "one in 590 million": a chance of no more than `probability`.
[[nodiscard]] std::string odds_words(double probability);

/// Which guarantee decides for which of the stated faults, and from which delay on, for the chosen detector: one
/// sentence for each fault and side, and before them what the filter has to do with it. Empty where nothing is said at
/// a risk.
[[nodiscard]] std::vector<std::string> choice_sentences(const commission::DetectorChoice& choice);

/// What each guarantee is worth, a sentence for each: how sure it is that a fault is seen, and that an alarm is one.
/// The second says why there is none where there is none.
[[nodiscard]] std::array<std::string, 2> how_sure(const commission::MarginSurvey& survey);

/// In which sense a size is called certain at the stated risk, one sentence.
[[nodiscard]] std::string risk_meaning(const commission::RiskMargins& margins);

/// A sentence or two for each fault and side: in which manoeuvres it is certainly seen, from what size on, how soon, by
/// which residual, and in which it is not certain.
[[nodiscard]] std::vector<std::string> margin_sentences(const commission::MarginSurvey& survey);

}  // namespace wheelwright::words

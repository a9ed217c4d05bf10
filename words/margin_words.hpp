// SPDX-License-Identifier: Apache-2.0
/// \file
/// Margins in words.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <wheelwright/commission/margin_survey.hpp>

namespace wheelwright::words {

/// A magnitude of a fault: a share as a percentage ("4.1 %"), else with its unit; "–" where it is infinite.
[[nodiscard]] std::string magnitude_words(const FaultType& fault, double magnitude);

/// Smallest certain size in one manoeuvre within window number `window`, in words: "4.1 %" at every onset of it in the
/// drive, "4.1 % at 5 of 7" onsets, "–" at none; of a fault without a size "yes", "at 3 of 7" or "–". Empty where the
/// drive has no such onset.
[[nodiscard]] std::string certain_words(const detector::FaultMargins& margins, std::size_t window,
                                        detector::ManoeuvreKind kind);

/// The window that tables show: the longest one up to a second.
[[nodiscard]] std::size_t shown_window(const commission::MarginSurvey& survey);

/// In which sense a size is called certain, one sentence.
[[nodiscard]] std::string certain_meaning(core::Warrant warrant);

/// A sentence or two for each fault and side: in which manoeuvres it is certainly seen, from what size on, how soon, by
/// which residual, and in which it is not certain.
[[nodiscard]] std::vector<std::string> margin_sentences(const commission::MarginSurvey& survey);

}  // namespace wheelwright::words

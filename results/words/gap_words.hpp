// SPDX-License-Identifier: Apache-2.0
/// \file
/// A diagnosed gap in words.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "gap/diagnosis.hpp"
#include "gap/effects/effect.hpp"

namespace wheelwright::words {

/// An effect as a noun: "coulomb" → "dry friction"; the identifier as words for one that is not known here.
[[nodiscard]] std::string effect_noun(std::string_view effect);

/// A cause as a noun: the effect's, or its family's where the log does not tell between laws of it ("late torque").
[[nodiscard]] std::string cause_noun(const gap::GapCause& cause);

/// Several as one: "dry friction with a dragging castor"; "none" for no effect.
[[nodiscard]] std::string effect_nouns(const std::vector<std::string>& effects);

/// A parameter of an effect as words: "angle_rad" → "angle", "side_right0_left1" → "side (0 right, 1 left)".
[[nodiscard]] std::string parameter_words(std::string_view parameter);

/// "0.312 N·m [0.290, 0.330]".
[[nodiscard]] std::string estimate_words(const gap::GapEstimate& estimate);

/// "12.3 [12.1, 12.5]" of a parameter with the causes; "not told from 0, at most 3.1" of one below zero that cannot be.
[[nodiscard]] std::string shift_words(const gap::ParameterShift& shift);

/// True where the log had no efforts, so that its pose alone was compared.
[[nodiscard]] bool pose_alone(const Diagnosis& diagnosis);

/// The headline: what the log says, in one sentence for each verdict.
[[nodiscard]] std::string gap_verdict(const Diagnosis& diagnosis);

/// Sentences after it: the causes with their parameters, the remaining residual, its place, causes that cannot be told
/// apart. `next_manoeuvre` is the sentence of the drive that would, or empty.
[[nodiscard]] std::vector<std::string> gap_sentences(const Diagnosis& diagnosis, const std::string& next_manoeuvre);

/// A step from the gap before its causes are in the model to what they leave, as a span of the gap: 0 is none, 1 all.
struct GapStep {
  std::string name;
  double from = 0.0;
  double to = 0.0;
};

/// "before" (all of the gap), what each cause takes off it, largest first, each from where the one before it left off;
/// what other parameters without a cause would take, where that is at least a per cent; and "after", what is left. The
/// first answer's where there are several. Empty for a diagnosis without causes.
[[nodiscard]] std::vector<GapStep> gap_steps(const Diagnosis& diagnosis);

/// Root mean square of the left side of `channel`, so that residuals can be told in per cent of it; 0 where there is no
/// such series.
[[nodiscard]] double signal_rms(const Diagnosis& diagnosis, std::string_view channel);

/// `text` with every name of an effect in it said in words: "dry friction with a delay of the torque" for "coulomb +
/// delay". What stands in backticks is for a file, and stays.
[[nodiscard]] std::string in_words(std::string text, const std::vector<Effect>& catalogue);

}  // namespace wheelwright::words

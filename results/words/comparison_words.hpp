// SPDX-License-Identifier: Apache-2.0
/// \file
/// Two models against each other in words, the same for terminal and page.
#pragma once

#include <string>
#include <vector>

#include "commission/model_comparison.hpp"

namespace wheelwright::words {

/// "0.8 to 2.1 kg more", "0.8 to 2.1 kg less"; "at most 0.3 kg less, at most 0.5 kg more" where 0 lies inside. Rounded
/// outward.
[[nodiscard]] std::string change_words(const Interval& change, const std::string& unit);

/// Which set it is: "guaranteed", "at a risk of 2e-09", with the wheels' named.
[[nodiscard]] std::string set_words(const commission::SetComparison& sets);

/// The answer in one sentence.
[[nodiscard]] std::string verdict(const commission::ModelComparison& comparison);

/// "0.759 ± 0.021", with two standard errors behind the ±.
[[nodiscard]] std::string value_words(const commission::BestGuess& guess);

/// "coulomb 0.759 ± 0.023 → 0.447 ± 0.016 N·m (22 standard errors)", with two standard errors behind the ±.
[[nodiscard]] std::string guess_words(const commission::GuessChange& change);

/// "mass, kg".
[[nodiscard]] std::string quantity_words(const commission::ParameterChange& parameter);

/// Best guesses that differ by more than chance, beyond the one in verdict(), and what explains the change: a sentence
/// for each explanation of each set that tells one. Empty where nothing is told.
[[nodiscard]] std::vector<std::string> explanations(const commission::ModelComparison& comparison);

/// What only one of the models has, in sentences, and that a change of the others may be what the other model lacks;
/// empty where both have the same.
[[nodiscard]] std::string not_compared(const commission::ModelComparison& comparison);

/// The whole for a terminal: verdict, explanations, a table for each set.
[[nodiscard]] std::string summary(const commission::ModelComparison& comparison);

}  // namespace wheelwright::words

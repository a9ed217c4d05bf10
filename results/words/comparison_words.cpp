// SPDX-License-Identifier: Apache-2.0
#include "results/words/comparison_words.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::words {
namespace {

using commission::ChangeExplanation;
using commission::GuessChange;
using commission::ModelComparison;
using commission::ParameterChange;
using commission::SetComparison;

// "mass (2.4 to 3.9 kg more)".
std::string changed_words(const SetComparison& sets, const ChangeExplanation& explanation) {
  std::vector<std::string> parts;
  for (std::size_t k = 0; k < explanation.parameters.size(); ++k) {
    const ParameterChange& parameter = sets.parameters[explanation.parameters[k]];
    parts.push_back(
        fmt::format("{} ({})", spaced(parameter.quantity), change_words(explanation.change[k], parameter.unit)));
  }
  return core::enumerated(parts);
}

std::string interval_words(const Interval& x) {
  const auto [lower, upper] = outward(x.lower, x.upper);
  return lower + " to " + upper;
}

}  // namespace

std::string change_words(const Interval& change, const std::string& unit) {
  if (change.lower > 0.0 || change.upper < 0.0) {
    const bool more = change.lower > 0.0;
    const auto [least, most] = more ? outward(change.lower, change.upper) : outward(-change.upper, -change.lower);
    return fmt::format("{} to {} {}", least, with_unit(most, unit_of(unit)), more ? "more" : "less");
  }
  const auto [down, up] = outward(change.lower, change.upper);
  const std::string less = down.starts_with("−") ? down.substr(std::string("−").size()) : down;
  return fmt::format("at most {} less or {} more", less, with_unit(up, unit_of(unit)));
}

std::string set_words(const SetComparison& sets) {
  return fmt::format("{}, {}", sets.wheels ? "wheel radii and yaw gains" : "dynamics",
                     sets.risk ? fmt::format("at a risk of {:.3g} ({})", *sets.risk, core::warrant_word(sets.warrant))
                               : std::string(core::warrant_word(sets.warrant)));
}

std::string value_words(const commission::BestGuess& guess) {
  const double reach = 2.0 * guess.standard_error;
  return fmt::format("{} ± {}", beside(guess.value, guess.value - reach, guess.value + reach), number(reach, 2));
}

std::string guess_words(const GuessChange& change) {
  return fmt::format("{} {} → {} ({:.0f} standard errors)", spaced(change.before.quantity), value_words(change.before),
                     with_unit(value_words(change.after), unit_of(change.before.unit)),
                     std::abs(change.standard_errors()));
}

std::string verdict(const ModelComparison& comparison) {
  const std::vector<const SetComparison*> telling = comparison.telling();
  const std::vector<GuessChange> likely = comparison.likely();
  if (telling.empty() && !likely.empty()) {
    return fmt::format("a change is likely, but not certain: {}", guess_words(likely.front()));
  }
  if (telling.empty()) {
    return "no change is told: one robot explains both logs";
  }
  std::vector<std::string> certain;
  for (const SetComparison* sets : telling) {
    for (const ParameterChange& parameter : sets->parameters) {
      std::string name = spaced(parameter.quantity);
      if (parameter.certain() && std::ranges::find(certain, name) == certain.end()) {
        certain.push_back(std::move(name));
      }
    }
  }
  const SetComparison& first = *telling.front();
  std::string text = certain.empty() ? "something has changed between the logs"
                                     : fmt::format("{} {} changed between the logs", core::enumerated(certain),
                                                   certain.size() == 1 ? "has" : "have");
  return text + fmt::format(": no one robot explains both{}",
                            first.risk ? fmt::format(", but for a risk of {:.3g}", *first.risk) : "");
}

std::vector<std::string> explanations(const ModelComparison& comparison) {
  std::vector<std::string> out, guesses;
  for (const GuessChange& each : comparison.likely()) {
    guesses.push_back(guess_words(each));
  }
  if (!comparison.changed() && !guesses.empty()) {
    guesses.erase(guesses.begin());  // the verdict has it
  }
  if (!guesses.empty()) {
    out.push_back(fmt::format("Best guesses differ by more than chance: {}.", core::enumerated(guesses)));
  }
  for (const SetComparison* sets : comparison.telling()) {
    const std::string promise = sets->risk ? fmt::format(" (at a risk of {:.3g})", *sets->risk) : "";
    if (sets->explanations.empty()) {
      out.push_back(fmt::format("No {} of {} {} it, and more at once were not tried{}.",
                                sets->sought == 1 ? "single parameter" : fmt::format("{} parameters", sets->sought),
                                sets->wheels ? "the wheels" : "the dynamics",
                                sets->sought == 1 ? "explains" : "explain", promise));
      continue;
    }
    const std::size_t size = sets->explanations.front().parameters.size();
    const std::string alone = size == 1   ? "alone explains it"
                              : size == 2 ? "explain it together, and no single parameter does"
                                          : "explain it together, and no fewer parameters do";
    for (const ChangeExplanation& explanation : sets->explanations) {
      out.push_back(fmt::format("{} {}{}.", core::capital(changed_words(*sets, explanation)), alone, promise));
    }
  }
  return out;
}

std::string quantity_words(const ParameterChange& parameter) {
  const std::string unit = unit_of(parameter.unit);
  return spaced(parameter.quantity) + (unit.empty() ? "" : ", " + unit);
}

std::string not_compared(const ModelComparison& comparison) {
  std::vector<std::string> parts;
  const auto add = [&](const std::vector<std::string>& names, std::string_view which) {
    if (!names.empty()) {
      parts.push_back(
          fmt::format("{} {} in the {} model only", core::listed(names), names.size() == 1 ? "is" : "are", which));
    }
  };
  add(comparison.only_before, "first");
  add(comparison.only_after, "second");
  return parts.empty() ? ""
                       : core::enumerated(parts) +
                             ": it was not compared; the other model takes it for zero, so that a change of another "
                             "parameter may be what that model lacks.";
}

std::string summary(const ModelComparison& comparison) {
  std::string text = core::capital(verdict(comparison)) + ".\n";
  if (const std::string rest = not_compared(comparison); !rest.empty()) {
    text += "  " + rest + "\n";
  }
  for (const std::string& sentence : explanations(comparison)) {
    text += "  " + sentence + "\n";
  }
  for (const SetComparison& sets : comparison.sets) {
    text += fmt::format("\n{}{}{}{}{}\n", padded("  " + set_words(sets), 46), padded("before", 24), padded("after", 24),
                        padded("change", 24), sets.compatible ? "if none" : "");
    for (const ParameterChange& parameter : sets.parameters) {
      text += padded("    " + quantity_words(parameter), 46) + padded(interval_words(parameter.before), 24) +
              padded(interval_words(parameter.after), 24) + padded(interval_words(parameter.change), 24) +
              (parameter.together    ? interval_words(*parameter.together)
               : parameter.certain() ? "changed"
                                     : "") +
              "\n";
    }
  }
  return text;
}

}  // namespace wheelwright::words

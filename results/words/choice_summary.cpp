// SPDX-License-Identifier: Apache-2.0
#include "results/words/choice_summary.hpp"

#include <cmath>

#include <fmt/format.h>

#include "results/words/detect_words.hpp"

namespace wheelwright::words {
namespace {

std::string or_dash(double value, const char* form) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(form), value) : "-";
}

const char* guarantee_word(commission::Guarantee guarantee) {
  switch (guarantee) {
    case commission::Guarantee::never: return "never";
    case commission::Guarantee::hourly: return "hourly";
    case commission::Guarantee::extrapolated: return "extrapol.";
  }
  return "";
}

std::string cost(const commission::DetectorCandidate& candidate, const commission::DetectorCandidate& chosen) {
  if (!std::isfinite(candidate.size)) {
    return "not certain";
  }
  std::string text = fmt::format("size {:+.1f} %", 100.0 * (candidate.size / chosen.size - 1.0));
  if (std::isfinite(candidate.delay) && std::isfinite(chosen.delay)) {
    text += fmt::format(", delay {:+.3f} s", candidate.delay - chosen.delay);
  }
  return text;
}

std::string candidate_table(const commission::DetectorChoice& choice) {
  // Once is enough where it is the same for all.
  const bool differs = choice.risk_spread.value_or(0.0) > choice.tie;
  std::string out = fmt::format(
      "smallest certain size over the stated one{}, within {:g} s, and delay of the stated size: medians, worst fault\n"
      "{:>5} {:>8} {:>10} {:>7} {:>8} {:>8}{}  {}\n",
      choice.either ? ", by whichever guarantee sees a fault first" : "", choice.window, "order", "beta", "alarms",
      "k of n", "size", "delay", differs ? "  at risk" : "", "against the chosen one");
  const commission::DetectorCandidate& chosen = choice.candidates.front();
  for (const commission::DetectorCandidate& candidate : choice.candidates) {
    out += fmt::format("{:>5} {:>8.4g} {:>10} {:>7} ", candidate.filter.order, candidate.filter.beta,
                       guarantee_word(candidate.guarantee),
                       fmt::format("{}/{}", candidate.persistence.k, candidate.persistence.n));
    if (!candidate.failure.empty()) {
      out += fmt::format("no detector: {}\n", candidate.failure);
      continue;
    }
    const std::string note =
        candidate.origin == "grid" || candidate.origin == "refined" ? "" : " (" + candidate.origin + ")";
    const std::string at_risk = candidate.size_at_risk ? or_dash(*candidate.size_at_risk, "{:.3f}") : "";
    out += fmt::format("{:>8} {:>8}{}  {}{}\n", or_dash(candidate.size, "{:.3f}"), or_dash(candidate.delay, "{:.3f}"),
                       differs ? fmt::format(" {:>8}", at_risk) : "",
                       &candidate == &chosen && choice.chosen ? "chosen" : cost(candidate, chosen), note);
  }
  return out;
}

std::string stated_faults(const commission::DetectorChoice& choice) {
  std::string out;
  for (const commission::StatedMargin& m : choice.candidates.front().faults) {
    out +=
        fmt::format("{} {}: certain from {} on at half of {} onsets, from {} at all; one of {:g} after {}\n", m.fault,
                    m.side > 0.0 ? "growing" : "shrinking", or_dash(m.median, "{:.3g}"), m.onsets,
                    or_dash(m.worst, "{:.3g}"), m.asked, std::isfinite(m.delay) ? fmt::format("{:g} s", m.delay) : "-");
  }
  return out;
}

}  // namespace

std::string summary(const commission::DetectorChoice& choice, const std::string& robot_file_line) {
  std::string text = candidate_table(choice) + stated_faults(choice);
  for (const std::string& sentence : choice_sentences(choice)) {
    text += sentence + "\n";
  }
  for (const std::string& name : choice.hopeless) {
    text += fmt::format("does not count: no candidate is certain to see {} at half of the onsets\n", name);
  }
  for (const std::string& note : choice.notes) {
    text += note + "\n";
  }
  return text + (choice.chosen ? fmt::format("for the robot file:\n{}\n", robot_file_line) : "");
}

}  // namespace wheelwright::words

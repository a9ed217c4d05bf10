// SPDX-License-Identifier: Apache-2.0
#include "results/words/gap_summary.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/words.hpp"
#include "gap/where.hpp"
#include "results/words/gap_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::words {
namespace {

std::string law_words(const gap::GapLaw& law, const std::string& indent) {
  std::string out = fmt::format("{}{}: {}\n", indent, core::capital(words::effect_noun(law.effect)), law.sentence);
  for (const gap::GapEstimate& p : law.parameters) {
    out += fmt::format("{}    {} {}\n", indent, words::parameter_words(p.name), words::estimate_words(p));
  }
  return out;
}

std::string causes_words(const Diagnosis& d) {
  std::string out;
  for (const gap::GapCause& cause : d.causes) {
    if (cause.laws.empty()) {
      out += law_words({cause.effect, cause.sentence, cause.parameters}, "  ");
      continue;
    }
    out += fmt::format("  {}, by one of these laws:\n", core::capital(words::cause_noun(cause)));
    for (const gap::GapLaw& law : cause.laws) {
      out += law_words(law, "    ");
    }
  }
  return out;
}

// The steps from before to after as bars on one scale, each cause's where it takes off what the one above it left.
std::string bars_words(const Diagnosis& d) {
  constexpr double kCells = 30.0;
  const std::vector<words::GapStep> steps = words::gap_steps(d);
  std::size_t longest = 0;
  for (const words::GapStep& step : steps) {
    longest = std::max(longest, step.name.size());
  }
  std::string out;
  for (const words::GapStep& step : steps) {
    const auto from = static_cast<int>(std::lround(kCells * step.from)),
               to = static_cast<int>(std::lround(kCells * step.to));
    std::string bar(static_cast<std::size_t>(from), ' ');
    for (int k = from; k < to; ++k) {
      bar += "█";
    }
    bar += from == to && step.to > step.from ? "▏" : "";
    out += fmt::format("  {:<{}}  {:<30} {:>4.0f} %\n", step.name, longest, bar, 100.0 * (step.to - step.from));
  }
  return out;
}

std::string figures_words(const std::vector<gap::ShrinkFigure>& figures, const std::string& what) {
  std::string out;
  for (const gap::ShrinkFigure& f : figures) {
    if (!std::isfinite(f.before) || !std::isfinite(f.after)) {
      continue;
    }
    out += fmt::format("  {:<38} {:>9} → {:>9} {}{}\n", what + ", " + words::spaced(f.name), words::number(f.before),
                       words::number(f.after), f.unit == "1" ? "" : f.unit,
                       f.floor > 0.0 ? ", floor " + words::number(f.floor) : "");
  }
  return out;
}

std::string parameters_words(const Diagnosis& d) {
  std::string out;
  for (const gap::ParameterShift& p : d.parametric) {
    out += fmt::format("  {:<20} {:>9} {}{}, {} with the causes\n", words::spaced(p.parameter),
                       words::number(p.without_causes), p.unit,
                       p.nominal ? " (nominal " + words::number(*p.nominal) + ")" : "", words::shift_words(p));
  }
  return out;
}

std::string titled(const std::string& title, const std::string& body) {
  return body.empty() ? body : title + ":\n" + body;
}

// The regimes in which most of what is left lies.
std::string places(const Diagnosis& d) {
  std::vector<std::string> names;
  for (const gap::GapShare& s : d.where) {
    if (s.kind != "channel" && s.kind != "time" && gap::is_finding(s) && names.size() < 3) {
      names.push_back(s.regime);
    }
  }
  return core::enumerated(names);
}

std::string next_step(const Diagnosis& d, const GapResults& r) {
  const auto file = [&r](const char* name) { return r.out + name; };
  const std::string improved =
      r.improved ? fmt::format("wheelwright commission LOG --robot {}", file("robot_improved.yaml")) : std::string();
  switch (d.verdict) {
    case gap::GapVerdict::no_gap:
      if (words::pose_alone(d)) {
        return "log the efforts, too: what changes the torque alone cannot be seen without them.";
      }
      return fmt::format("wheelwright commission LOG --robot {}; nothing is to be added to it.", r.robot);
    case gap::GapVerdict::explained:
      return !improved.empty() ? improved + ", for thresholds that are not widened by what the model lacked."
             : r.out.empty()   ? "run this with --out DIR, which writes the robot file with the causes in it."
                               : "the robot file cannot carry these causes (see the notes): mend them, or model them.";
    case gap::GapVerdict::ambiguous:
      return r.commands ? fmt::format("drive {}, then wheelwright gap on that log.", file("next_manoeuvre.csv"))
                        : std::string("a measurement that tells the causes apart; until then any of them is a guess.");
    case gap::GapVerdict::unexplained: {
      if (d.misfit && d.causes.empty()) {
        return "add to the robot file what the healthy robot has and the model lacks, or choose another model.";
      }
      const std::string where = places(d);
      return "add a term to the model: what is left lies in " +
             (where.empty() ? std::string("no regime more than in others") : where) + ".";
    }
  }
  return {};
}

}  // namespace

std::string summary(const Diagnosis& d, const GapResults& r) {
  std::string out = words::gap_verdict(d) + "\n";
  for (const std::string& sentence : words::gap_sentences(d, {})) {
    out += sentence + "\n";
  }
  out += titled(gap::answers_among(d.credible) > 1 ? "the gap by cause, those of the first answer" : "the gap by cause",
                bars_words(d));
  out += titled("causes, 95 % intervals", causes_words(d));
  out += titled("held out, before → after the causes are in the model",
                figures_words(d.shrink.torque_rms, "torque residual") +
                    figures_words(d.shrink.fresh_torque_rms, "torque residual, fresh log") +
                    figures_words(d.shrink.rollout, "rollout") +
                    figures_words(d.shrink.threshold_width, "width of the threshold") +
                    figures_words(d.shrink.smallest_fault, "smallest radius fault"));
  out += titled("parameters fitted to this log without the causes", parameters_words(d));
  for (const std::string& note : d.notes) {
    out += "note: " + note + "\n";
  }
  if (!r.next_manoeuvre.empty()) {
    out += r.next_manoeuvre + "\n";
  }
  if (r.naive) {
    out += fmt::format("the naive rule (forward selection by BIC over samples) says: {}\n",
                       words::effect_nouns(r.naive_effects));
  }
  return out + "next: " + next_step(d, r) + "\n";
}

}  // namespace wheelwright::words

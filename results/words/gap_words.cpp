// SPDX-License-Identifier: Apache-2.0
#include "results/words/gap_words.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <functional>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "gap/effects/effect.hpp"
#include "gap/where.hpp"
#include "results/words/text.hpp"

namespace wheelwright::words {

using gap::GapVerdict;

namespace {

constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kParameterNames{{
    {"mass_kg", "mass"},
    {"angle_rad", "angle"},
    {"uphill_heading_rad", "uphill heading"},
    {"dt", "time offset"},
    {"epsilon", "relative change"},
    {"inertia_gap", "inertia times play"},
    {"side_right0_left1", "side (0 right, 1 left)"},
    {"right0_left1_opposite2", "side (0 right, 1 left, 2 both, opposite)"},
}};

std::string whole_percent(double share) { return decimal(100.0 * share, 0) + "\u00a0%"; }

// A residual in two significant digits of per cent.
std::string small_percent(double share) { return number(100.0 * share, 2) + "\u00a0%"; }

std::string channel_words(const std::string& channel) {
  return channel == "sum" || channel == "difference" ? channel + " channel" : spaced(channel);
}

// "0.312 N·m [0.290, 0.330]" for one parameter, "a …, b …" for several.
std::string parameters_of(const std::vector<gap::GapEstimate>& parameters) {
  if (parameters.size() == 1) {
    return estimate_words(parameters.front());
  }
  std::vector<std::string> parts;
  for (const gap::GapEstimate& p : parameters) {
    parts.push_back(parameter_words(p.name) + " " + estimate_words(p));
  }
  return core::enumerated(parts);
}

constexpr std::size_t kInHeadline = 2;  // parameters of a single cause

std::string cause_sentence(const gap::GapCause& cause, bool alone) {
  std::string out = core::capital(cause_noun(cause));
  out += cause.parametric && cause.laws.empty() ? "" : alone ? ", which the model lacks," : "";
  out += fmt::format(" {} {} of the gap", alone ? "explains" : "accounts for", whole_percent(cause.share));
  return cause.parameters.empty() || !cause.laws.empty() || (alone && cause.parameters.size() > kInHeadline)
             ? out + "."
             : out + ": " + parameters_of(cause.parameters) + ".";
}

// The laws between which the log does not tell, with their numbers.
std::string laws_sentence(const gap::GapCause& cause) {
  if (cause.laws.empty()) {
    return {};
  }
  std::vector<std::string> laws;
  for (const gap::GapLaw& law : cause.laws) {
    laws.push_back(effect_noun(law.effect) +
                   (law.parameters.empty() ? "" : " (" + parameters_of(law.parameters) + ")"));
  }
  return fmt::format("This log does not tell by which law: {}.", core::listed(laws, ", or "));
}

// What is said of a healthy robot that the model does not fit.
std::string misfit_sentence(const Diagnosis& d) {
  if (!d.misfit) {
    return {};
  }
  const gap::HealthyMisfit& m = *d.misfit;
  std::string out = fmt::format("This model does not fit the healthy robot: of its efforts' mean square {} stay",
                                percent(m.share, 2));
  if (!m.known.empty()) {
    std::vector<std::string> nouns;
    std::ranges::transform(m.known, std::back_inserter(nouns), effect_noun);
    out += " with " + core::enumerated(nouns) + " added";
  }
  out += ", most in the " + channel_words(m.channel) + (m.regime.empty() ? "" : " (" + m.regime + ")") + ".";
  if (!m.helping.empty()) {
    std::vector<std::string> nouns;
    std::ranges::transform(m.helping, std::back_inserter(nouns), effect_noun);
    out += " Of the catalogue " + core::listed(nouns, " or ") + " would help most, and not enough.";
  }
  return out;
}

// The smallest sizes of a few causes that would have been seen.
std::string visible_sentence(const Diagnosis& d) {
  constexpr std::array<std::string_view, 6> kTold{"coulomb", "viscous", "payload",
                                                  "delay",   "slope",   "wheel_radius_asymmetric"};
  std::vector<std::string> parts;
  for (const std::string_view effect : kTold) {
    const auto size = std::ranges::find(d.visible, effect, &gap::VisibleSize::effect);
    if (size != d.visible.end()) {
      parts.push_back(
          fmt::format("{} from {}", effect_noun(effect), with_unit(number(size->size, 2), unit_of(size->unit))));
    }
  }
  return parts.empty() ? std::string() : "Each of these alone would have shown: " + core::listed(parts) + ".";
}

// Causes of a headline: more than two are counted, the sentences after it name them.
std::string few_or_count(const std::vector<std::string>& names) {
  return names.size() > 2 ? fmt::format("{} causes", names.size()) : core::enumerated(names);
}

// The channel whose residual was largest against its signal.
const gap::ShrinkFigure* worst_channel(const Diagnosis& d) {
  const gap::ShrinkFigure* worst = nullptr;
  double largest = -1.0;
  for (const gap::ShrinkFigure& f : d.shrink.torque_rms) {
    const double rms = signal_rms(d, f.name), relative = rms > 0.0 ? f.before / rms : 0.0;
    if (relative > largest) {
      largest = relative;
      worst = &f;
    }
  }
  return worst;
}

std::string residual_size(const Diagnosis& d, const gap::ShrinkFigure& f, double value) {
  const double rms = signal_rms(d, f.name);
  return rms > 0.0 ? small_percent(value / rms) : with_unit(number(value), f.unit);
}

std::string shrink_sentence(const Diagnosis& d) {
  const gap::ShrinkFigure* f = worst_channel(d);
  if (f == nullptr || !std::isfinite(f->before) || !std::isfinite(f->after)) {
    return {};
  }
  if (d.causes.empty()) {
    std::string out = fmt::format("The residual of the {} is {} of its torque on held-out driving",
                                  channel_words(f->name), residual_size(d, *f, f->before));
    return f->floor > 0.0 ? out + "; noise alone leaves " + residual_size(d, *f, f->floor) + "." : out + ".";
  }
  std::string out = fmt::format("After adding {} the held-out residual of the {} {} from {} to {}",
                                d.causes.size() == 1 ? "it" : "them", channel_words(f->name),
                                f->after <= f->before ? "falls" : "goes", residual_size(d, *f, f->before),
                                residual_size(d, *f, f->after));
  return f->floor > 0.0 ? out + "; the noise floor is " + residual_size(d, *f, f->floor) + "." : out + ".";
}

// What a channel of the residual is of.
std::string subject_words(const std::string& channel) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 5> kSubjects{
      {{"sum", "the driving torque"},
       {"difference", "the turning torque"},
       {"forward", "forward motion"},
       {"lateral", "lateral motion"},
       {"yaw", "turning motion"}}};
  const auto known = std::ranges::find(kSubjects, channel, &std::pair<std::string_view, std::string_view>::first);
  return known != kSubjects.end() ? std::string(known->second) : "the " + channel_words(channel);
}

// Where what no θ makes up is concentrated, the largest shares of all of it first.
std::string where_sentence(const Diagnosis& d) {
  constexpr std::size_t kMost = 3;
  constexpr double kAll = 0.995, kMostly = 0.9;
  std::vector<std::pair<double, std::string>> places;
  for (const gap::GapShare& s : d.where) {
    if (s.kind == "channel" || s.kind == "time" || !gap::is_finding(s)) {
      continue;
    }
    const auto channel = std::ranges::find_if(d.where, [&](const gap::GapShare& other) {
      return other.kind == "channel" && other.channel == s.channel && other.space == s.space;
    });
    const bool band = s.kind == "frequency" && !s.regime.empty();
    const std::string at = !band                              ? " (" + s.regime + ")"
                           : core::is_digit(s.regime.front()) ? " at " + s.regime
                                                              : " " + s.regime;
    places.emplace_back(s.share * (channel == d.where.end() ? 1.0 : channel->share), subject_words(s.channel) + at);
  }
  std::ranges::stable_sort(places, std::ranges::greater(), &std::pair<double, std::string>::first);
  std::vector<std::string> parts;
  for (const auto& [share, place] : places) {
    if (parts.size() < kMost) {
      parts.push_back(place + " holds " + (share < kAll ? whole_percent(share) : "all"));
    }
  }
  return parts.empty() ? std::string()
                       : fmt::format("Where: {} of {}.", core::enumerated(parts),
                                     d.structural < kMostly * d.gap ? "what no other parameters make up" : "the gap");
}

// How far the simulator is from the robot, and the robot's own model beside it.
std::string simulator_sentence(const Diagnosis& d) {
  if (d.reference != gap::GapReference::simulator || pose_alone(d)) {
    return {};
  }
  return fmt::format(
      "The simulator leaves {} of the mean square of the robot's efforts above the noise; the model of the robot file, "
      "fitted to the robot's log, leaves {}.",
      percent(d.gap), percent(d.structural));
}

// What became of such answers where the truth was known.
std::string record_sentence(const Diagnosis& d) {
  if (!d.record || d.record->logs == 0) {
    return {};
  }
  const gap::TrackRecord& r = *d.record;
  const std::string on = "on simulated logs of other robots, their causes withheld,";
  switch (d.verdict) {
    case GapVerdict::no_gap: return fmt::format("Of {} such answers {} {} were right.", r.logs, on, r.first);
    case GapVerdict::explained:
      return fmt::format("Of {} such answers {} {} were right; {} of the {} causes they named were there.", r.logs, on,
                         r.first, r.present, r.causes);
    case GapVerdict::ambiguous:
      return fmt::format("Of {} such answers {} the first was right in {}, another in {}, and none in {}.", r.logs, on,
                         r.first, r.other, r.logs - r.first - r.other);
    case GapVerdict::unexplained:
      return d.causes.empty()
                 ? std::string()
                 : fmt::format("Of {} causes that were named so {} {} were there.", r.causes, on, r.present);
  }
  return {};
}

// Each answer by the noun of its first set; a cause of which other sets have other laws by that of its family.
std::vector<std::string> answer_nouns(const Diagnosis& d) {
  std::vector<std::string> nouns;
  for (const gap::CredibleCauses& set : d.credible) {
    if (set.answer != nouns.size()) {
      continue;
    }
    std::vector<std::string> parts;
    for (const std::string& effect : set.effects) {
      const auto cause = std::ranges::find(d.causes, effect, &gap::GapCause::effect);
      parts.push_back(set.answer == 0 && cause != d.causes.end() ? cause_noun(*cause) : effect_noun(effect));
    }
    nouns.push_back(parts.empty() ? "none" : core::listed(parts, " with "));
  }
  return nouns;
}

// Those that fit best; the rest of many is counted.
std::vector<std::string> credible_names(const Diagnosis& d) {
  constexpr std::size_t kMost = 6;
  std::vector<std::string> names = answer_nouns(d);
  const std::size_t all = names.size(), told = all > kMost ? kMost - 1 : all;
  names.resize(told);
  if (told < all) {
    names.push_back(fmt::format("one of {} others that the report lists", all - told));
  }
  return names;
}

}  // namespace

std::string parameter_words(std::string_view parameter) {
  for (const auto& [name, text] : kParameterNames) {
    if (name == parameter) {
      return std::string(text);
    }
  }
  return spaced(parameter);
}

std::string effect_noun(std::string_view effect) {
  const std::string noun = gap::catalogue_noun(effect);
  return noun.empty() ? spaced(effect) : noun;
}

std::string cause_noun(const gap::GapCause& cause) {
  return cause.laws.empty() ? effect_noun(cause.effect) : gap::family_noun(cause.family);
}

std::string effect_nouns(const std::vector<std::string>& effects) {
  std::string out;
  for (const std::string& effect : effects) {
    out += (out.empty() ? "" : " with ") + effect_noun(effect);
  }
  return out.empty() ? "none" : out;
}

std::string estimate_words(const gap::GapEstimate& e) {
  const std::string unit = unit_of(e.unit);
  if (!std::isfinite(e.lower) || !std::isfinite(e.upper)) {
    return with_unit(number(e.estimate), unit);
  }
  const auto [low, high] = outward(e.lower, e.upper);
  return fmt::format("{} [{}, {}]", with_unit(beside(e.estimate, e.lower, e.upper), unit), low, high);
}

std::string shift_words(const gap::ParameterShift& shift) {
  const auto [low, high] = outward(shift.lower, shift.upper);
  return std::isfinite(shift.estimate)
             ? fmt::format("{} [{}, {}]", beside(shift.estimate, shift.lower, shift.upper), low, high)
             : "not told from 0, at most " + high;
}

double signal_rms(const Diagnosis& d, std::string_view channel) {
  for (const gap::ResidualSeries& s : d.series) {
    if (s.channel == channel && s.signal.size() > 0) {
      return std::sqrt(s.signal.squaredNorm() / static_cast<double>(s.signal.size()));
    }
  }
  return 0.0;
}

bool pose_alone(const Diagnosis& d) {
  const auto has = [&d](gap::GapSpace space) {
    return std::ranges::any_of(d.series,
                               [space](const gap::ResidualSeries& s) { return s.space == space && s.t.size() > 0; });
  };
  return has(gap::GapSpace::kinematic) && !has(gap::GapSpace::dynamic);
}

std::string gap_verdict(const Diagnosis& d) {
  std::vector<std::string> names;
  double share = 0.0;
  for (const gap::GapCause& cause : d.causes) {
    names.push_back(cause_noun(cause));
    share += cause.share;
  }
  switch (d.verdict) {
    case GapVerdict::no_gap:
      return pose_alone(d)
                 ? "No gap in the pose: it is what the wheels say, to the noise floor; of the torque nothing is known."
             : d.reference == gap::GapReference::simulator
                 ? "No gap: the simulator needs the efforts that the robot needed, to the noise floor."
                 : "No gap: the model explains the log to the noise floor.";
    case GapVerdict::explained:
      return names.empty()       ? "The gap is explained."
             : names.size() == 1 ? cause_sentence(d.causes.front(), true)
                                 : fmt::format("{} together explain {} of the gap.", core::capital(few_or_count(names)),
                                               whole_percent(share));
    case GapVerdict::ambiguous:
      return gap::answers_among(d.credible) > 1
                 ? fmt::format("The gap has one of {} causes, which this log cannot tell apart.",
                               gap::answers_among(d.credible))
                 : "The gap has causes that this log cannot tell apart.";
    case GapVerdict::unexplained:
      return names.empty() && d.misfit
                 ? "This model does not fit the healthy robot, so that this log shows no gap and no absence of one."
             : names.empty()
                 ? "There is a gap, and no effect of the catalogue explains it."
                 : fmt::format("The gap is not explained: {} of it stays when {} {} added.", whole_percent(d.remaining),
                               few_or_count(names), names.size() == 1 ? "is" : "are");
  }
  return {};
}

std::vector<std::string> gap_sentences(const Diagnosis& d, const std::string& next_manoeuvre) {
  std::vector<std::string> out;
  const auto add = [&out](std::string sentence) {
    if (!sentence.empty()) {
      out.push_back(std::move(sentence));
    }
  };
  add(simulator_sentence(d));
  if (d.verdict == GapVerdict::no_gap) {
    add(shrink_sentence(d));
    add(visible_sentence(d));
    add(record_sentence(d));
    return out;
  }
  add(misfit_sentence(d));
  if (d.verdict == GapVerdict::unexplained && d.causes.empty()) {
    add(visible_sentence(d));
  }
  if (d.verdict == GapVerdict::ambiguous && gap::answers_among(d.credible) > 1) {
    add(fmt::format("It may be {}", fmt::join(credible_names(d), ", or ")) +
        ". What follows is of the first of these: it fits best, but not by more than chance.");
  }
  if (d.verdict != GapVerdict::explained || d.causes.size() > 1) {  // a single one is the headline
    for (const gap::GapCause& cause : d.causes) {
      add(cause_sentence(cause, d.causes.size() == 1));
    }
  }
  for (const gap::GapCause& cause : d.causes) {
    add(laws_sentence(cause));
    if (d.causes.size() == 1 && cause.laws.empty() && cause.parameters.size() > kInHeadline) {
      add(core::capital(effect_noun(cause.effect)) + ": " + parameters_of(cause.parameters) + ".");
    }
  }
  add(shrink_sentence(d));
  if (d.verdict == GapVerdict::unexplained && !(d.causes.empty() && d.misfit)) {
    add("Something acts on the robot that is in no model of the catalogue, or in one that this log does not show; the "
        "causes that are named are what helps most, not what is the matter.");
  }
  add(record_sentence(d));
  add(where_sentence(d));
  if (d.verdict == GapVerdict::explained && gap::answers_among(d.credible) > 1) {
    const std::vector<std::string> names = credible_names(d);
    add(fmt::format("Within the confidence of 90 % {} would do as well on this log.",
                    core::enumerated({names.begin() + 1, names.end()})));
  }
  add(next_manoeuvre);
  return out;
}

std::vector<GapStep> gap_steps(const Diagnosis& d) {
  constexpr double kTold = 0.01;
  if (d.causes.empty()) {
    return {};
  }
  std::vector<GapStep> steps{{"before", 0.0, 1.0}};
  double left = 1.0;
  const auto take = [&](const std::string& name, double share) {
    const double rest = std::clamp(left - share, 0.0, 1.0);
    steps.push_back({name, rest, left});
    left = rest;
  };
  for (const gap::GapCause& cause : d.causes) {
    take(cause_noun(cause), cause.share);
  }
  if (left - d.remaining >= kTold) {
    take("other parameters, without a cause", left - d.remaining);
  }
  steps.push_back({"after", 0.0, d.remaining});
  return steps;
}

std::string in_words(std::string text, const std::vector<Effect>& catalogue) {
  const auto of_a_name = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  std::string out;
  bool quoted = false;
  for (std::size_t at = 0; at < text.size();) {
    quoted = quoted != (text[at] == '`');
    std::size_t end = at;
    while (end < text.size() && of_a_name(text[end])) {
      ++end;
    }
    const std::string word = text.substr(at, end - at);
    const bool effect = !quoted && gap::find_effect(catalogue, word) != nullptr;
    out += effect ? effect_noun(word) : word;
    if (effect && text.compare(end, 3, " + ") == 0) {
      out += " with ";
      end += 3;
    } else if (end < text.size()) {
      out += text[end++];
    }
    at = end;
  }
  return out;
}

}  // namespace wheelwright::words

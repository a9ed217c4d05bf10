// SPDX-License-Identifier: Apache-2.0
#include "results/words/detect_words.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "commission/choice/detector_choice.hpp"
#include "commission/choice/detector_trial.hpp"
#include "commission/event_isolation.hpp"
#include "core/limits.hpp"
#include "core/words.hpp"
#include "results/words/commission_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::words {
namespace {

double largest(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::max_element(values.begin(), values.end());
}

// "Of 60 s of driving 2.1 s contradict the fault-free model in the output sum and 0.3 s in difference."
std::string contradicting(const Detection& detection, const OnlineModel& model) {
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < detection.outside.size(); ++i) {
    if (detection.outside[i] > 0) {
      const double share = static_cast<double>(detection.outside[i]) / static_cast<double>(detection.instants);
      parts.push_back(with_unit(number(share * detection.seconds), "s") + (parts.empty() ? " in the output " : " in ") +
                      output_name(model.model, i));
    }
  }
  return fmt::format("Of {} of driving, {} {}.", with_unit(number(detection.seconds, 4), "s"),
                     parts.empty() ? "0 s" : core::enumerated(parts),
                     detection.residual == detector::Residual::d2 ? "are outside the constant thresholds"
                                                                  : "contradict the fault-free model");
}

// What the first event can be, in a sentence; empty where it was not asked.
std::string first_isolation(const std::vector<detector::Isolation>& isolations) {
  if (isolations.empty()) {
    return {};
  }
  std::vector<std::string> possible;
  for (const detector::FaultFinding& f : isolations.front().findings) {
    if (f.verdict == detector::FaultFinding::Verdict::consistent) {
      possible.push_back(f.fault.sentence.empty() ? spaced(f.fault.name) : f.fault.sentence);
    }
  }
  const std::size_t excluded = isolations.front().count(detector::FaultFinding::Verdict::excluded);
  if (possible.empty()) {
    return fmt::format(
        "No fault of the catalogue explains the first event: {} are excluded by proof, each as a step that "
        "stays.",
        excluded);
  }
  const std::size_t left = isolations.front().count_at_risk();
  const std::string fewer =
      left < possible.size() ? fmt::format(" At the stated risk {} of these {} left.", left, left == 1 ? "is" : "are")
                             : std::string();
  return fmt::format(
      "{} faults of the catalogue are excluded by proof for the first event, each as a step that stays; possible "
      "{}: {}.{}",
      excluded, possible.size() == 1 ? "remains" : "remain", fmt::join(possible, "; or "), fewer);
}

}  // namespace

std::string detect_verdict(const Detection& detection, std::size_t kinematic_events, bool undecided) {
  if (detection.instants == 0 && kinematic_events == 0) {
    return "Nothing was watched: the log has no instant with a decision.";
  }
  const std::size_t events = detection.events.size() + kinematic_events;
  return events == 0 && undecided ? "Not decided: of most of the log nothing is known."
         : events == 0
             ? "No fault was seen."
             : fmt::format("{}: the robot did not behave like its model.", core::capital(plural(events, "event")));
}

std::vector<std::string> detect_words(const Detection& detection, const OnlineModel& model,
                                      const std::vector<detector::Isolation>& isolations, const TimeAxis& axis) {
  const std::string watched = fmt::format("{} instants were watched over {} of driving.", count(detection.instants),
                                          with_unit(number(detection.seconds, 4), "s"));
  if (detection.instants == 0) {
    return {
        watched,
        "The filter needs some time to settle at the beginning of every segment: the log, or each of its segments, is "
        "too short."};
  }
  if (detection.events.empty()) {
    return {
        watched,
        fmt::format("The residual stayed inside its threshold or left it too briefly for an alarm; it went {} of the "
                    "way to the threshold at most.",
                    percent(largest(detection.utilisation))),
        detection.residual == detector::Residual::d2
            ? "A fault smaller than the threshold allows for, or one that does not show in this driving, is not "
              "excluded."
            : "A fault smaller than the threshold allows for, or one that does not show in this driving, is not "
              "excluded: `wheelwright margins` says which faults this log would have shown."};
  }
  std::vector<std::string> out;
  const detector::Event& first =
      *std::min_element(detection.events.begin(), detection.events.end(),
                        [](const detector::Event& a, const detector::Event& b) { return a.alarm < b.alarm; });
  const detector::Event& worst =
      *std::max_element(detection.events.begin(), detection.events.end(),
                        [](const detector::Event& a, const detector::Event& b) { return a.peak_ratio < b.peak_ratio; });
  out.push_back(fmt::format(
      "The first alarm came at {} in the output {}{}.", axis.text(first.alarm), output_name(model.model, first.output),
      first.start < first.alarm ? fmt::format("; the residual had left its threshold at {}", axis.text(first.start))
                                : std::string()));
  out.push_back(contradicting(detection, model));
  out.push_back(
      fmt::format("The clearest excess is at {} in the output {}: {} times as far from the middle of [l, u] as the "
                  "threshold allows.",
                  axis.text(worst.peak_time), output_name(model.model, worst.output), number(worst.peak_ratio)));
  out.emplace_back(
      detection.residual == detector::Residual::d2
          ? "A fault, an effect that was absent when the robot was commissioned (payload, floor), or a false alarm: "
            "the "
            "thresholds are constants by experiment, and nothing is proved. What the fault can be is not told by them."
          : "Without a fault no parameter of the feasible set and no admissible noise explains this: a fault, an "
            "effect "
            "that was absent when the robot was commissioned (payload, floor), or noise beyond its bounds.");
  if (std::string text = first_isolation(isolations); !text.empty()) {
    out.push_back(std::move(text));
  }
  return out;
}

namespace {

constexpr std::size_t kMostOthers = 3;  // that are written out

// What is known of the size of the first candidate whether it is a step or not; empty where nothing was asked.
std::string any_course(const detector::Incident& incident) {
  if (incident.sizes.empty()) {
    return {};
  }
  std::string text = fmt::format(" (whether it is a step or not: present no later than {:.2f} s", incident.start);
  const auto size = std::ranges::find(incident.sizes, incident.candidates.front().finding.fault.name,
                                      [](const detector::SizeOverTime& s) { return s.fault.name; });
  if (size != incident.sizes.end()) {
    const std::string known = commission::sentence(*size);
    text += (known.empty() ? "" : "; " + known) + (size->growing_excluded ? "; its size fell at some time" : "");
  }
  return text + ")";
}

// Faults that explain it if they grow, and not as steps.
std::string only_as_growing(const detector::Incident& incident) {
  std::vector<std::string> names;
  for (const detector::SizeOverTime& size : incident.sizes) {
    const bool candidate = std::ranges::any_of(incident.candidates, [&](const detector::IncidentCandidate& c) {
      return c.finding.fault.name == size.fault.name;
    });
    if (!candidate && !size.growing_excluded && !size.growing.empty()) {
      const std::string known = commission::sentence(size);
      names.push_back(size.fault.sentence + (known.empty() ? "" : ", " + known));
    }
  }
  if (names.empty()) {
    return {};
  }
  const std::size_t shown = std::min(names.size(), kMostOthers);
  return fmt::format("; as a fault that grows also possible: {}{}",
                     fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(shown), "; "),
                     names.size() > shown ? fmt::format("; and {} more", names.size() - shown) : "");
}

// A fault that may have caused an incident, by the course that it has to have.
std::string candidate_words(const detector::IncidentCandidate& candidate, bool stays) {
  using detector::CourseClass;
  const model::FaultType& fault = candidate.finding.fault;
  std::string text;
  switch (candidate.course) {
    case CourseClass::step:
      text = commission::sentence(candidate.finding) +
             (candidate.changes && stays ? " (its size changes: that of the last event)" : "");
      break;
    case CourseClass::growing: text = fault.sentence + ", a fault that grew"; break;
    case CourseClass::any: text = fault.sentence + ", a fault whose size rose and fell"; break;
  }
  if (candidate.guess && !fault.whole) {
    const bool share = fault.unit == "1";
    text += fmt::format(", best fit at the end {:.3g} {}", (share ? 100.0 : 1.0) * *candidate.guess,
                        share ? "%" : fault.unit);
  }
  return text;
}

constexpr double kFitsBadly = 0.5;  // of the deviation, left by the best course
constexpr double kFitsNot = 0.95;   // the same: its fault is no nearer than none

}  // namespace

std::string incident_sentence(const detector::Incident& incident) {
  std::vector<std::string> faults;
  for (const detector::IncidentCandidate& candidate : incident.candidates) {
    faults.push_back(candidate_words(candidate, incident.stays));
  }
  std::string text;
  if (faults.empty()) {
    text = incident.examined == 0                      ? "not examined"
           : incident.unexplained == incident.examined ? "nothing of the catalogue that was examined explains this"
                                                       : "no one fault of the catalogue that stays explains all of "
                                                         "this: several faults, or one that grows";
    text += fmt::format(", since {:.2f} s", incident.start);
  } else if (incident.candidates.front().left.value_or(0.0) > kFitsNot) {
    text = fmt::format(
        "no fault of the catalogue fits this: another load or ground (compare with the log that the "
        "model was learnt on by `wheelwright gap`), several faults, or one that it lacks; {} of the "
        "catalogue {} not excluded",
        plural(faults.size(), "fault"), faults.size() == 1 ? "is" : "are");
  } else {
    const detector::IncidentCandidate& first = incident.candidates.front();
    const bool told = first.left || first.course != detector::CourseClass::step;
    const bool none_at_risk = std::ranges::all_of(incident.candidates, [](const detector::IncidentCandidate& c) {
      return c.finding.at_risk && c.finding.at_risk->excluded;
    });
    const auto alike = static_cast<std::size_t>(
        std::ranges::count(incident.candidates, true, &detector::IncidentCandidate::as_likely));
    text =
        told && first.left.value_or(0.0) > kFitsBadly
            ? "no fault of the catalogue fits this well: another load or ground (compare with the log that the model "
              "was learnt on by `wheelwright gap`), several faults, or one that it lacks; the nearest: "
        : !told && !incident.stays
            ? fmt::format(
                  "no one fault that stays explains all of this: several faults, or one that grows; from the "
                  "event at {:.2f} s on it may be: ",
                  first.since)
        : none_at_risk ? "at the stated risk no fault that was examined, each as one that stays; for certain not "
                         "excluded: "
                       : "";
    text += faults.front() + any_course(incident);
    const auto list = [&](std::size_t from, std::size_t to) {
      const std::size_t shown = std::min(to, from + kMostOthers);
      text += fmt::format("{}{}",
                          fmt::join(faults.begin() + static_cast<std::ptrdiff_t>(from),
                                    faults.begin() + static_cast<std::ptrdiff_t>(shown), "; "),
                          to > shown ? fmt::format("; and {} more", to - shown) : "");
    };
    if (alike > 0) {
      text += "; this log does not tell it from: ";
      list(1, 1 + alike);
    }
    if (faults.size() > 1 + alike) {
      text += told ? "; less likely, not excluded: " : none_at_risk && incident.stays ? "; " : "; also possible: ";
      list(1 + alike, faults.size());
    }
  }
  text += only_as_growing(incident);
  text += fmt::format(" ({} from {:.2f} to {:.2f} s", plural(incident.events, "event"), incident.start, incident.end);
  if (!faults.empty() && incident.unexplained > 0) {
    text += fmt::format(", {} of them explained by no fault that was examined", incident.unexplained);
  }
  return text + ").";
}

namespace {

// What is best known of one fault on one side in one manoeuvre, over the residuals.
struct Best {
  detector::MarginSummary summary;
  std::string residual;
};

Best best_of(const commission::MarginSurvey& survey, const detector::FaultMargins& of, std::size_t window,
             detector::ManoeuvreKind kind) {
  Best best;
  for (const commission::ResidualMargins& residual : survey.residuals) {
    for (const detector::FaultMargins& each : residual.margins) {
      if (each.fault.name == of.fault.name && each.side == of.side) {
        const detector::MarginSummary summary = detector::summarise(each, window, kind);
        if (summary.onsets > 0 && (best.residual.empty() || summary.worst < best.summary.worst ||
                                   (summary.worst == best.summary.worst && summary.best < best.summary.best))) {
          best = {summary, residual.name};
        }
      }
    }
  }
  return best;
}

// The first window in which `size` is certain at every onset of the manoeuvre, s.
double delay_of(const commission::MarginSurvey& survey, const detector::FaultMargins& of, detector::ManoeuvreKind kind,
                double size) {
  for (std::size_t w = 0; w < survey.windows.size(); ++w) {
    const Best best = best_of(survey, of, w, kind);
    if (!best.residual.empty() && best.summary.worst <= size) {
      return survey.windows[w];
    }
  }
  return survey.windows.back();
}

// "wheel radius (+)".
std::string name_of(const detector::FaultMargins& of) {
  std::string name = of.fault.name;
  std::replace(name.begin(), name.end(), '_', ' ');
  if (!of.fault.whole && of.fault.range.lower < 0.0) {
    name += of.side > 0.0 ? " (+)" : " (−)";
  }
  return name;
}

std::string sentence(const commission::MarginSurvey& survey, const detector::FaultMargins& of) {
  const std::size_t window = shown_window(survey);
  std::vector<std::string> seen, at_best, unseen;
  for (const auto& [kind, onsets] : survey.manoeuvres) {
    const Best best = best_of(survey, of, window, kind);
    if (best.residual.empty()) {
      continue;
    }
    const std::string where(detector::manoeuvre_words(kind));
    if (std::isfinite(best.summary.worst)) {
      const std::string size = of.fault.whole ? "" : "from " + magnitude_words(of.fault, best.summary.worst) + " on ";
      seen.push_back(fmt::format("{}within {:g} s while {} ({})", size, delay_of(survey, of, kind, best.summary.worst),
                                 where, best.residual));
    } else if (std::isfinite(best.summary.best)) {
      const std::string share = fmt::format("{} of {}", best.summary.certain, best.summary.onsets);
      at_best.push_back(of.fault.whole ? fmt::format("{} ({})", where, share)
                                       : fmt::format("{} (from {} on at {})", where,
                                                     magnitude_words(of.fault, best.summary.most), share));
    } else {
      unseen.push_back(where);
    }
  }
  std::string out = name_of(of) + ": ";
  out += seen.empty() ? "not certain to be seen at every moment of any manoeuvre"
                      : "certainly seen " + core::enumerated(seen);
  if (!at_best.empty()) {
    out += fmt::format("; at some moments only while {}", core::enumerated(at_best));
  }
  if (!unseen.empty()) {
    out += fmt::format("; not certain while {}", core::enumerated(unseen));
  }
  return out + ".";
}

}  // namespace

std::string magnitude_words(const model::FaultType& fault, double magnitude) {
  if (!std::isfinite(magnitude)) {
    return "–";
  }
  // Upwards: a size that is printed is certain.
  const double scale = fault.unit == "1" ? 100.0 : 1.0, value = magnitude * scale;
  const double step = value > 0.0 ? std::pow(10.0, std::floor(std::log10(value)) - 1.0) : 1.0;
  const double shown = std::ceil(value / step * (1.0 - 1e-12)) * step;
  return fmt::format("{:.6g} {}", shown, fault.unit == "1" ? "%" : fault.unit);
}

std::string certain_words(const detector::FaultMargins& margins, std::size_t window, detector::ManoeuvreKind kind) {
  const detector::MarginSummary summary = detector::summarise(margins, window, kind);
  if (summary.onsets == 0) {
    return "";
  }
  if (!std::isfinite(summary.best)) {
    return "–";
  }
  if (margins.fault.whole) {
    return summary.certain == summary.onsets ? "yes" : fmt::format("at {} of {}", summary.certain, summary.onsets);
  }
  const std::string size = magnitude_words(margins.fault, summary.most);
  return summary.certain == summary.onsets ? size
                                           : fmt::format("{} at {} of {}", size, summary.certain, summary.onsets);
}

std::size_t shown_window(const commission::MarginSurvey& survey) {
  std::size_t shown = 0;
  for (std::size_t w = 0; w < survey.windows.size(); ++w) {
    shown = survey.windows[w] <= 1.0 ? w : shown;
  }
  return shown;
}

std::string certain_meaning(core::Warrant warrant) {
  return warrant == core::Warrant::guaranteed
             ? "“Certain” is meant as guaranteed: for all parameters that the commissioning "
               "log allows and for every noise "
               "within the sensors’ declared bounds, while the assumptions listed hold."
         : warrant == core::Warrant::statistical
             ? "“Certain” is meant statistically: for all parameters that the "
               "commissioning log allows, at the confidence "
               "at which the sensors’ declared noise was taken through the filter."
             : "“Certain” is extrapolated: it takes the noise bounds that were learnt "
               "from the commissioning log for true "
               "and holds as far as noise and driving stay like that log.";
}

std::vector<RiskSizes> risk_sizes(const commission::MarginSurvey& survey) {
  std::vector<RiskSizes> all;
  if (!survey.at_risk) {
    return all;
  }
  // The median within the longest window up to `within`.
  const auto median = [](const detector::FaultMargins& margins, const std::vector<double>& windows, double within) {
    const auto end = std::ranges::upper_bound(windows, within);
    return end == windows.begin()
               ? core::kInfinity
               : detector::summarise(margins, static_cast<std::size_t>(end - windows.begin()) - 1).median;
  };
  const auto words = [](const detector::FaultMargins& margins, double size) {
    return margins.fault.whole && std::isfinite(size) ? std::string("yes") : magnitude_words(margins.fault, size);
  };
  for (const detector::FaultMargins& margins : survey.at_risk->margins) {
    RiskSizes sizes{name_of(margins), {}, {}};
    bool any = false;
    for (const double within : kRiskWindows) {
      double worst_case = core::kInfinity;
      for (const commission::ResidualMargins& residual : survey.residuals) {
        for (const detector::FaultMargins& each : residual.margins) {
          if (each.fault.name == margins.fault.name && each.side == margins.side) {
            worst_case = std::min(worst_case, median(each, survey.windows, within));
          }
        }
      }
      const double size = median(margins, survey.at_risk->windows, within);
      sizes.worst_case.push_back(words(margins, worst_case));
      sizes.at_risk.push_back(words(margins, size));
      any = any || std::isfinite(size);
    }
    if (any) {
      all.push_back(std::move(sizes));
    }
  }
  return all;
}

double DetectionCurve::size_within(const std::vector<std::pair<double, double>>& curve, double within) {
  double size = core::kInfinity;
  for (const auto& [delay, at] : curve) {
    size = delay <= within ? std::min(size, at) : size;
  }
  return size;
}

std::vector<DetectionCurve> detection_curves(const commission::MarginSurvey& survey,
                                             const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 3;
  const auto wanted = [&](const detector::FaultMargins& margins) {
    return std::ranges::find(names, margins.fault.name) != names.end();
  };
  const std::vector<detector::FaultMargins>& all = survey.residuals.front().margins;
  const bool any = std::ranges::any_of(all, wanted);
  std::vector<DetectionCurve> curves;
  for (const detector::FaultMargins& margins : all) {
    const bool known = !curves.empty() && curves.back().fault.name == margins.fault.name;
    if (!known && !margins.fault.whole && (any ? wanted(margins) : curves.size() < kMost)) {
      curves.push_back({margins.fault, {}, {}});
    }
  }
  // The larger of the sides, of each side the smallest of several residuals.
  const auto largest = [](const DetectionCurve& curve,
                          const std::vector<const std::vector<detector::FaultMargins>*>& of, std::size_t window) {
    double size = 0.0;
    for (const double side : {1.0, -1.0}) {
      double best = core::kInfinity;
      bool there = false;
      for (const std::vector<detector::FaultMargins>* list : of) {
        for (const detector::FaultMargins& margins : *list) {
          if (margins.fault.name == curve.fault.name && margins.side == side) {
            best = std::min(best, detector::summarise(margins, window).median);
            there = true;
          }
        }
      }
      size = there ? std::max(size, best) : size;
    }
    return size;
  };
  const auto fill = [&](const DetectionCurve& curve, const std::vector<double>& windows,
                        const std::vector<const std::vector<detector::FaultMargins>*>& of) {
    std::vector<std::pair<double, double>> points;
    for (std::size_t w = 0; w < windows.size(); ++w) {
      const double size = largest(curve, of, w);
      if (std::isfinite(size) && size > 0.0) {
        points.emplace_back(windows[w], size);
      }
    }
    return points;
  };
  std::vector<const std::vector<detector::FaultMargins>*> residuals;
  for (const commission::ResidualMargins& residual : survey.residuals) {
    residuals.push_back(&residual.margins);
  }
  for (DetectionCurve& curve : curves) {
    curve.every_noise = fill(curve, survey.windows, residuals);
    if (survey.at_risk) {
      curve.at_risk = fill(curve, survey.at_risk->windows, {&survey.at_risk->margins});
    }
  }
  return curves;
}

std::string odds_words(double probability) {
  if (!(probability > 0.0)) {
    return "none";
  }
  const double odds = 1.0 / probability;
  const double power = std::pow(10.0, std::floor(std::log10(odds)) - 1.0);
  const double rounded = std::floor(odds / power) * power;
  return rounded >= 1e6   ? fmt::format("one in {:.10g} million", rounded / 1e6)
         : rounded >= 100 ? "one in " + count(static_cast<std::size_t>(rounded))
                          : fmt::format("one in {:g}", rounded);
}

std::vector<std::string> choice_sentences(const commission::DetectorChoice& choice) {
  std::vector<std::string> sentences;
  if (!choice.chosen || !choice.candidates.front().miss) {
    return sentences;
  }
  const commission::DetectorCandidate& chosen = choice.candidates.front();
  const auto size = [](const commission::StatedMargin& margin, double of) {
    return !std::isfinite(of)   ? std::string("no size")
           : margin.unit == "1" ? percent(of, 2)
                                : with_unit(number(of, 2), margin.unit);
  };
  const auto after = [](double delay) {
    return std::isfinite(delay) ? fmt::format("after {:.3g} s", delay) : std::string("not certain");
  };
  // The candidate that is best at the risk, where it is another.
  const commission::DetectorCandidate* best = &chosen;
  for (const commission::DetectorCandidate& each : choice.candidates) {
    best = each.size_at_risk && *each.size_at_risk < *best->size_at_risk * (1.0 - choice.tie) ? &each : best;
  }
  const double spread = choice.risk_spread.value_or(0.0);
  if (spread <= choice.tie) {
    sentences.emplace_back(
        "At the stated risk all candidates are certain of the same sizes: the sums do not pass through the filter, "
        "which "
        "decides for every noise alone.");
  } else {
    sentences.push_back(
        fmt::format("At the stated risk {}: the sums do not pass through the filter, but its order says whether they "
                    "read speeds or "
                    "angles, and their set is a part of its guaranteed one.",
                    std::isfinite(spread) ? "the candidates’ sizes differ by up to " + percent(spread, 2)
                                          : std::string("some candidates are certain of faults that others are not")));
  }
  if (best != &chosen) {
    sentences.push_back(fmt::format(
        "Best at the risk is order {}, β = {}, with {} of the stated size where the chosen one has {}{}.",
        best->filter.order, number(best->filter.beta), number(*best->size_at_risk), number(*chosen.size_at_risk),
        choice.either ? "" : "; `--guarantee either` chooses by whichever guarantee sees a fault first"));
  }
  for (const commission::StatedMargin& margin : chosen.faults) {
    const std::optional<double> from = commission::risk_decides_from(margin, choice.window);
    const double step = choice.window / static_cast<double>(margin.medians.size());
    const std::string who = !from                 ? "the guarantee for every noise decides at every delay"
                            : *from <= step * 1.5 ? "the stated risk decides at every delay"
                                                  : fmt::format(
                                                        "the guarantee for every noise decides up to {:.3g} s, the "
                                                        "stated risk from there on",
                                                        *from - step);
    sentences.push_back(fmt::format(
        "{} {}: {}; within {:g} s {} for every noise, {} at the risk; one of {} is seen {} for every noise, {} at the "
        "risk.",
        spaced(margin.fault), margin.side > 0.0 ? "growing" : "shrinking", who, choice.window,
        size(margin, margin.median), size(margin, margin.at_risk ? margin.at_risk->median : core::kInfinity),
        size(margin, margin.asked), after(margin.delay),
        after(margin.at_risk ? margin.at_risk->delay : core::kInfinity)));
  }
  sentences.push_back(
      fmt::format("At the risk{}: such a fault is missed with a probability of at most {:.2g} ({}).",
                  chosen.risk_warrant == core::Warrant::guaranteed ? "" : ", while errors stay as this log shows them",
                  *chosen.miss, odds_words(*chosen.miss)));
  return sentences;
}

std::array<std::string, 2> how_sure(const commission::MarginSurvey& survey) {
  constexpr double kYear = 365.25 * 86400.0;
  const core::Warrant warrant = survey.residuals.front().warrant;
  std::array<std::string, 2> sure;
  sure[0] = warrant == core::Warrant::guaranteed
                ? "For every noise within its bounds: such a fault is never missed, and there is never a false alarm, "
                  "whatever the noise does within the declared bounds."
            : warrant == core::Warrant::statistical
                ? "For every noise within its bounds, as they hold at the confidence at which the declared noise was "
                  "taken through the filter."
                : "For every noise within its bounds, as they were extrapolated from the commissioning log.";
  if (!survey.at_risk) {
    sure[1] = "Nothing is said at a stated risk: " + survey.without_risk + ".";
    return sure;
  }
  const commission::RiskMargins& risk = *survey.at_risk;
  sure[1] = fmt::format(
      "At the stated risk, while errors average out as {}: such a fault is missed with a probability of at most {:.2g} "
      "({}), and at most one false alarm is to be expected in {:.2g} years of driving.",
      risk.warrant == core::Warrant::guaranteed ? "the robot file declares" : "the commissioning log shows them",
      risk.miss, odds_words(risk.miss), 1.0 / (risk.false_alarms * kYear));
  return sure;
}

std::string risk_meaning(const commission::RiskMargins& margins) {
  return fmt::format(
      "“At the stated risk” is meant for all parameters that the set at a risk of {:g} allows, while the errors "
      "average out as the robot file declares: a fault of that size, in a drive whose encoders read like this one, is "
      "missed with a probability of at most {:.2g}.{}",
      margins.risk, margins.miss,
      margins.pose.empty() ? ""
                           : " Where the pose shows it, its sums are weighted as in this log: what other errors of the "
                             "pose make of the weights is not allowed for.");
}

std::vector<std::string> margin_sentences(const commission::MarginSurvey& survey) {
  std::vector<std::string> sentences;
  for (const detector::FaultMargins& of : survey.residuals.front().margins) {
    sentences.push_back(sentence(survey, of));
  }
  return sentences;
}

}  // namespace wheelwright::words

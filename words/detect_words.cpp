// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/words/detect_words.hpp>

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/words/parameter_view.hpp>
#include <wheelwright/words/text.hpp>

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
  return fmt::format("Of {} of driving, {} contradict the fault-free model.",
                     with_unit(number(detection.seconds, 4), "s"), parts.empty() ? "0 s" : core::enumerated(parts));
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
    return fmt::format("No fault of the catalogue explains the first event: {} are excluded by proof.", excluded);
  }
  const std::size_t left = isolations.front().count_at_risk();
  const std::string fewer =
      left < possible.size() ? fmt::format(" At the stated risk {} of these {} left.", left, left == 1 ? "is" : "are")
                             : std::string();
  return fmt::format("{} faults of the catalogue are excluded by proof for the first event; possible {}: {}.{}",
                     excluded, possible.size() == 1 ? "remains" : "remain", fmt::join(possible, "; or "), fewer);
}

}  // namespace

std::string detect_verdict(const Detection& detection, std::size_t kinematic_events) {
  if (detection.instants == 0 && kinematic_events == 0) {
    return "Nothing was watched: the log has no instant with a decision.";
  }
  const std::size_t events = detection.events.size() + kinematic_events;
  return events == 0
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
        "A fault smaller than the threshold allows for, or one that does not show in this driving, is not excluded: "
        "`wheelwright margins` says which faults this log would have shown."};
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
      "Without a fault no parameter of the feasible set and no admissible noise explains this: a fault, an effect "
      "that was absent when the robot was commissioned (payload, floor), or noise beyond its bounds.");
  if (std::string text = first_isolation(isolations); !text.empty()) {
    out.push_back(std::move(text));
  }
  return out;
}

}  // namespace wheelwright::words

// SPDX-License-Identifier: Apache-2.0
#include "results/words/detect_summary.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "commission/constant_thresholds.hpp"
#include "results/words/commission_words.hpp"
#include "results/words/detect_words.hpp"

namespace wheelwright::words {

std::string event_line(const detector::Event& e, const OnlineModel& model) {
  return fmt::format("t = {:.3f} s: fault in the {} channel (first outside at {:.3f} s, {:.2f} times the threshold)",
                     e.alarm, model.model.outputs[e.output], e.start, e.peak_ratio);
}

std::string why_undecided(const OnlineModel& model, std::size_t rows, double step) {
  constexpr double sparser = 1.5;  // steps of the model, from which on sparseness is worth a word
  const double nominal = model.measurement.nominal_step;
  const double ratio = nominal > 0.0 ? step / nominal : 1.0;
  std::string text = "no instant was decided, so that nothing is known of faults: ";
  for (const auto& [factor, unit] : {std::pair{1e3, "ms"}, std::pair{1e6, "µs"}, std::pair{1e9, "ns"}}) {
    if (ratio > 0.2 * factor && ratio < 5.0 * factor) {
      return text + fmt::format(
                        "the rows are {:.4g} s apart, {:.3g} times as far as those that the model was commissioned "
                        "on ({:.4g} s); is their time in {}? It has to be in s",
                        step, ratio, nominal, unit);
    }
  }
  if (commission::hardly_goes_on(step, nominal)) {
    return fmt::format(
        "nothing is known of faults: the rows are {:.4g} s apart, {:.3g} times as far as those that the model was "
        "commissioned on ({:.4g} s), by a clock that hardly goes on; is their time in s?",
        step, ratio, nominal);
  }
  if (ratio > sparser) {
    return text + fmt::format(
                      "the rows are {:.4g} s apart, {:.3g} times as far as those that the model was commissioned on "
                      "({:.4g} s): log faster, or commission on a log like this one",
                      step, ratio, nominal);
  }
  return text + fmt::format(
                    "{} row{} {:.4g} s apart are too few, or too often interrupted, for the filter, which settles in "
                    "{:.3g} s",
                    rows, rows == 1 ? "" : "s", step, model.filter.settle / model.filter.beta);
}

std::string why_mostly_undecided(std::size_t instants, std::size_t rows, const std::vector<std::string>& repairs) {
  return fmt::format("only {} of {} rows could be decided on, so that of most of the log nothing is known{}{}",
                     instants, rows, repairs.empty() ? "" : ": ", fmt::join(repairs, "; "));
}

std::string why_not_decided(const Detection& detection, const OnlineModel& model, std::size_t rows, double step,
                            std::size_t met, const std::vector<std::string>& repairs) {
  switch (commission::how_watched(detection, model, step, met)) {
    case commission::Watched::enough: return {};
    case commission::Watched::little: return why_mostly_undecided(detection.instants, met, repairs);
    case commission::Watched::no_time:
    case commission::Watched::nothing: break;
  }
  return why_undecided(model, rows, step);
}

std::string why_blind(const OnlineModel& model, const std::vector<std::string>& causes) {
  return causes.empty()
             ? fmt::format("rows too few, or too often interrupted, for the filter, which settles in {:.3g} s",
                           model.filter.settle / model.filter.beta)
             : fmt::format("{}", fmt::join(causes, "; "));
}

std::string crawling_words(const OnlineModel& model, std::size_t rows) {
  return fmt::format(
      "{} row{} came less than a hundredth of the model's step ({:.4g} s) behind the one before, by a clock that "
      "hardly goes on; is their time in s?",
      rows, rows == 1 ? "" : "s", model.measurement.nominal_step);
}

std::string blind_line(const commission::BlindSpell& spell, std::optional<double> until, const std::string& why) {
  const std::string from = spell.since ? fmt::format("since t = {:.3f} s", *spell.since) : "from the start";
  return fmt::format("blind {}{}: {} rows ({:.1f} s) without a decision, so that nothing is known of faults: {}", from,
                     until ? fmt::format(" until {:.3f} s", *until) : "", spell.rows, spell.seconds, why);
}

std::string silence_line(const commission::StreamSilence& silence) {
  return fmt::format(
      "silent {}{}: no row for {:.1f} s by the clock of this machine, so that nothing is known of faults",
      silence.since ? fmt::format("since t = {:.3f} s", *silence.since) : "from the start",
      silence.until ? fmt::format(" until {:.3f} s", *silence.until) : "", silence.seconds);
}

namespace {

// What the thresholds stand on, a line.
std::string thresholds_line(const Detection& d, const OnlineModel& model) {
  if (d.residual == detector::Residual::d2) {
    return fmt::format("  {}\n", commission::sentence(*model.constant));
  }
  return fmt::format("  thresholds: {}\n", core::warrant_word(model.warrant));
}

}  // namespace

std::string summary(const Detection& d, const OnlineModel& model) {
  std::string text;
  if (d.instants == 0) {
    return {};  // why_undecided() is told instead
  }
  if (d.events.empty()) {
    text = fmt::format("no fault in {:.1f} s ({} instants)\n", d.seconds, d.instants);
  } else {
    text = fmt::format("{} fault event{} in {:.1f} s ({} instants)\n", d.events.size(), d.events.size() == 1 ? "" : "s",
                       d.seconds, d.instants);
    constexpr std::size_t most = 20;
    for (std::size_t k = 0; k < std::min(d.events.size(), most); ++k) {
      text += "  " + event_line(d.events[k], model) + "\n";
    }
    if (d.events.size() > most) {
      text += fmt::format("  … and {} more (--json lists them all)\n", d.events.size() - most);
    }
  }
  text += thresholds_line(d, model);
  for (std::size_t i = 0; i < d.utilisation.size(); ++i) {
    text += fmt::format("  {}: residual {:.2g} % of the torque, at most {:.0f} % of its threshold used\n",
                        model.model.outputs[i], 100.0 * d.nrmse[i], 100.0 * d.utilisation[i]);
  }
  return text;
}

std::string summary(const std::optional<commission::OtherParameters>& other) {
  return other ? commission::sentence(*other) + "\n" : std::string();
}

std::string summary(const std::vector<detector::Incident>& incidents, const std::function<std::string(double)>& clock) {
  std::string text;
  for (std::size_t k = 0; k < incidents.size(); ++k) {
    const std::string moment = clock ? clock(incidents[k].start) : std::string();
    text += fmt::format("incident {}{}: {}\n", k + 1, moment.empty() ? "" : fmt::format(" ({})", moment),
                        incident_sentence(incidents[k]));
  }
  return text;
}

std::string summary(const commission::RiskWatch& watch, const OnlineModel& model) {
  if (!watch.watched) {
    return {};
  }
  constexpr double kYear = 365.25 * 86400.0;
  std::string text = fmt::format(
      "at a stated risk (at most one false alarm in {:.2g} years of driving): {}\n", 1.0 / (watch.false_alarms * kYear),
      watch.events.empty() ? fmt::format("no fault; at most {:.0f} % of a threshold used", 100.0 * watch.utilisation)
                           : fmt::format("{} event{}", watch.events.size(), watch.events.size() == 1 ? "" : "s"));
  constexpr std::size_t most = 20;
  for (std::size_t k = 0; k < std::min(watch.events.size(), most); ++k) {
    text += "  " + commission::sentence(watch.events[k], model.model) + "\n";
  }
  if (watch.events.size() > most) {
    text += fmt::format("  … and {} more (--json lists them all)\n", watch.events.size() - most);
  }
  return text;
}

std::string summary(const commission::KinematicWatch& watch, const OnlineModel& model) {
  if (!watch.detection) {
    return "kinematic residual: not watched, " + watch.message + "\n";
  }
  const Detection& d = *watch.detection;
  if (d.instants == 0) {
    return "kinematic residual: no decision, the log is shorter than its window\n";
  }
  const OnlineModel view = commission::with_kinematic_outputs(model);
  std::string text = fmt::format(
      "kinematic residual: {} in {:.1f} s ({} instants)\n",
      d.events.empty() ? "no fault" : fmt::format("{} fault event{}", d.events.size(), d.events.size() == 1 ? "" : "s"),
      d.seconds, d.instants);
  constexpr std::size_t most = 20;
  for (std::size_t k = 0; k < std::min(d.events.size(), most); ++k) {
    text += "  " + event_line(d.events[k], view) + "\n";
  }
  if (d.events.size() > most) {
    text += fmt::format("  … and {} more (--json lists them all)\n", d.events.size() - most);
  }
  text += thresholds_line(d, view);
  for (std::size_t i = 0; i < d.utilisation.size(); ++i) {
    text +=
        fmt::format("  {}: at most {:.0f} % of its threshold used\n", view.model.outputs[i], 100.0 * d.utilisation[i]);
  }
  return text;
}

}  // namespace wheelwright::words

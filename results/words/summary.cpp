// SPDX-License-Identifier: Apache-2.0
#include "results/words/summary.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "commission/assumptions.hpp"
#include "commission/physical.hpp"
#include "core/statistics.hpp"
#include "identify/noise_level.hpp"
#include "results/words/commission_words.hpp"
#include "results/words/detect_words.hpp"

namespace wheelwright::words {
namespace {

// One line of the parameter table: name, estimate, interval of bounds, statistical half-width, unit.
std::string line(const std::string& name, const std::optional<double>& estimate, double lower, double upper,
                 const std::optional<double>& half, const std::string& unit, bool lower_is_prior, bool upper_is_prior) {
  const auto end = [](double value, bool prior) { return fmt::format("{:.5g}{}", value, prior ? " (prior)" : ""); };
  return fmt::format("  {:<20} {:>11}   [{}, {}]{}  {}\n", name, estimate ? fmt::format("{:.5g}", *estimate) : "-",
                     end(lower, lower_is_prior), end(upper, upper_is_prior),
                     half && std::isfinite(*half) ? fmt::format("   ± {:.2g}", *half) : "", unit);
}

std::string parameter_table(const Commissioning& r) {
  const Robot& robot = r.model.robot;
  const auto scales = commission::physical_scales(robot, r.model.model);
  const double t = core::student_quantile(0.95, std::max(r.residuals.freedom, 1.0));
  std::string text = fmt::format("  {:<20} {:>11}   {} interval   ± 95 % statistical\n", "parameter", "estimate",
                                 core::warrant_word(commission::interval_warrant(r)));
  for (std::size_t j = 0; j < r.parameters.size(); ++j) {
    const commission::ParameterResult& p = r.parameters[j];
    const commission::PhysicalScale s = scales ? (*scales)[j] : commission::PhysicalScale{};
    const auto value = [&](double theta) { return s.scale * theta - s.offset; };
    const auto estimate = p.estimate ? std::optional(value(*p.estimate)) : std::nullopt;
    const auto half = p.standard_error && std::isfinite(*p.standard_error)
                          ? std::optional(t * std::abs(s.scale) * *p.standard_error)
                          : std::nullopt;
    text += line(scales ? p.parameter.physical : p.parameter.name, estimate, value(p.lower), value(p.upper), half,
                 scales ? p.parameter.physical_unit : commission::parameter_unit(robot, p.parameter), p.lower_is_prior,
                 p.upper_is_prior);
    if (r.at_risk && r.at_risk->set) {
      const Interval& side = r.at_risk->set->hull().sides[j];
      text += fmt::format("  {:<20} {:>11}   [{:.5g}, {:.5g}]   at a risk of {:g}\n", "", "", value(side.lower),
                          value(side.upper), r.at_risk->risk);
    }
    if (!p.reason.empty()) {
      text += fmt::format("  {:<20} {}\n", "", p.reason);
    }
  }
  if (!scales) {
    text +=
        "  (physical values need the motor's constants in the robot file: motor: {torque_constant, gear_ratio, …})\n";
  }
  text +=
      fmt::format("  {}\n  {}\n", core::warrant_meaning(commission::interval_warrant(r)), core::statistical_remark());
  if (r.at_risk && r.at_risk->set) {
    text += fmt::format("  {}\n", risk_remark(*r.at_risk));
  }
  return text;
}

std::string kinematic_table(const commission::KinematicCommissioning& k) {
  std::string text;
  if (k.model) {
    text += fmt::format("  {:<20} {:>11}   {} interval\n", "pose or gyro", "estimate",
                        core::warrant_word(k.model->warrant));
  }
  for (const commission::KinematicParameter& p : k.parameters) {
    text += line(p.name, p.estimate, p.lower, p.upper, std::nullopt, p.unit == "1" ? "" : p.unit, false, false);
  }
  const auto outputs = k.model ? k.model->measurement.outputs() : std::vector<std::string>();
  const auto units = k.model ? k.model->measurement.output_units() : std::vector<std::string>();
  for (std::size_t i = 0; i < k.validation.size(); ++i) {
    const commission::OutputValidation& v = k.validation[i];
    text += fmt::format("  held out, {}: {} false alarms in {} instants, median width of the threshold {:.3g} {}\n",
                        outputs[i], v.outside, v.instants, v.median_width, units[i]);
  }
  return text;
}

// How many assumptions hold, and those that fail, with what shows it.
std::string assumption_lines(const std::vector<core::Assumption>& assumptions) {
  using Verdict = core::AssumptionVerdict;
  const auto number = [&](Verdict verdict) {
    return std::ranges::count(assumptions, verdict, &core::Assumption::verdict);
  };
  std::string text = fmt::format("  assumptions: {} hold on this log, {} not tested, {} fail (model.json lists them)\n",
                                 number(Verdict::holds), number(Verdict::not_tested), number(Verdict::fails));
  for (const core::Assumption& a : assumptions) {
    if (a.verdict == Verdict::fails) {
      text += fmt::format("    fails: {} {}\n", a.statement, a.detail);
    }
  }
  return text;
}

std::string contradiction_table(const Commissioning& r) {
  std::string text = "  samples that contradict one another:\n";
  for (const bounds::WeightedRow& row : r.feasible.contradiction) {
    const bounds::RowOrigin& o = row.row.origin;
    text += o.is_prior
                ? fmt::format("    prior bound of {}\n", r.model.model.parameters[o.parameter].physical)
                : fmt::format("    t = {:.3f} s, row {}, {} channel\n", o.t, o.sample, r.model.model.outputs[o.output]);
  }
  return text;
}

std::string contradiction_notes(const Commissioning& r) {
  std::string text;
  for (const commission::LogContradiction& c : r.contradictions) {
    text += fmt::format("  {}: {}\n    → {}\n", c.withdraws ? "contradiction" : "doubt", c.sentence, c.next);
  }
  return text;
}

// What is certain to be seen at the stated risk.
std::string reach_lines(const Commissioning& r) {
  if (r.reach.empty()) {
    return {};
  }
  const bool estimated = r.model.at_risk && r.model.at_risk->warrant == core::Warrant::extrapolated;
  std::string text = fmt::format(
      "  certainly seen at the stated risk (one false alarm in ten years{}) within 1 s, 5 s, 20 s, from half of all "
      "moments of such a drive:\n",
      estimated ? " while the errors stay as this log shows them" : "");
  for (const commission::RiskReach& reach : r.reach) {
    text += "    " + commission::sentence(reach, r.model.model) + "\n";
  }
  return text;
}

}  // namespace

std::string smallest_fault(const Robot& robot, double kappa) {
  if (!(kappa <= commission::whole_effort)) {
    return "no fault that scales the effort is certainly seen: the threshold is as wide as the effort itself";
  }
  const std::string change = model::on_two_wheels(robot)
                                 ? fmt::format("the wheel radius by {:.2g} %", 100.0 * radius_change(kappa))
                                 : fmt::format("the effort by {:.2g} %", 100.0 * kappa);
  return "a change of " + change + " is certainly seen at the best moment";
}

std::string summary(const Commissioning& r) {
  std::string text = fmt::format("{}: {}\n", r.model.robot.name, r.message);
  text += fmt::format("  {} rows in {} segment{}, {:.1f} s; filter of order {}, beta {:g} 1/s (delay {:.2g} s)\n",
                      r.survey.rows, r.survey.segments, r.survey.segments == 1 ? "" : "s", r.survey.seconds,
                      r.model.filter.order, r.model.filter.beta, r.model.filter.delay());
  if (r.status == Commissioning::Status::empty) {
    return text + contradiction_table(r) + contradiction_notes(r) + assumption_lines(r.assumptions);
  }
  if (r.status == Commissioning::Status::contradicted) {
    return text + contradiction_notes(r);
  }
  text += parameter_table(r) + contradiction_notes(r);
  if (!r.estimators.reason.empty()) {
    text += fmt::format("  estimated by {}\n", r.estimators.reason);
  }
  for (std::size_t i = 0; i < r.validation.size(); ++i) {
    const commission::OutputValidation& v = r.validation[i];
    if (v.instants == 0) {
      text += fmt::format("  held out, {}: too little driving to hold any out\n", r.model.model.outputs[i]);
      continue;
    }
    text += fmt::format("  held out, {}: {} false alarms in {} instants, residual {:.2g} % of the torque",
                        r.model.model.outputs[i], v.outside, v.instants, 100.0 * v.nrmse);
    text += "; " + smallest_fault(r.model.robot, v.smallest_kappa) + "\n";
  }
  if (!r.validation.empty() && r.model.warrant != core::Warrant::guaranteed) {
    text += fmt::format("  {}\n", certain_meaning(r.model.warrant));
  }
  text += reach_lines(r);
  text += kinematic_table(r.kinematic);
  text += assumption_lines(r.assumptions);
  for (const std::string& note : r.notes) {
    text += "  note: " + note + "\n";
  }
  return text;
}

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
  text += fmt::format("  thresholds: {}\n", core::warrant_word(model.warrant));
  for (std::size_t i = 0; i < d.utilisation.size(); ++i) {
    text += fmt::format("  {}: residual {:.2g} % of the torque, at most {:.0f} % of its threshold used\n",
                        model.model.outputs[i], 100.0 * d.nrmse[i], 100.0 * d.utilisation[i]);
  }
  return text;
}

std::string summary(const std::vector<detector::Incident>& incidents) {
  std::string text;
  for (std::size_t k = 0; k < incidents.size(); ++k) {
    text += fmt::format("incident {}: {}\n", k + 1, incident_sentence(incidents[k]));
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
  text += fmt::format("  thresholds: {}\n", core::warrant_word(view.warrant));
  for (std::size_t i = 0; i < d.utilisation.size(); ++i) {
    text +=
        fmt::format("  {}: at most {:.0f} % of its threshold used\n", view.model.outputs[i], 100.0 * d.utilisation[i]);
  }
  return text;
}

}  // namespace wheelwright::words

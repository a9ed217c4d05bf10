// SPDX-License-Identifier: Apache-2.0
#include "results/words/commission_summary.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "commission/assumptions.hpp"
#include "commission/constant_thresholds.hpp"
#include "commission/physical.hpp"
#include "core/statistics.hpp"
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
  const bool little = !r.little.why.empty();
  const std::string word = little ? "" : fmt::format("{} ", core::warrant_word(commission::interval_warrant(r)));
  std::string text = fmt::format("  {:<20} {:>11}   {}interval   ± 95 % statistical\n", "parameter", "estimate", word);
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
  text += fmt::format("  {}\n  {}\n", little ? little_meaning : core::warrant_meaning(commission::interval_warrant(r)),
                      core::statistical_remark());
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
  if (k.model && k.model->constant) {
    text += fmt::format("  D2, pose or gyro: {}\n", commission::sentence(*k.model->constant));
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
  for (const core::Assumption& a : assumptions) {
    if (a.verdict == Verdict::not_tested && !a.detail.empty()) {
      text += fmt::format("    not tested: {} ({})\n", a.statement, a.detail);
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
  if (r.model.constant) {
    text += fmt::format("  D2: {}\n", commission::sentence(*r.model.constant));
  }
  text += reach_lines(r);
  text += kinematic_table(r.kinematic);
  text += assumption_lines(r.assumptions);
  for (const std::string& note : r.notes) {
    text += "  note: " + note + "\n";
  }
  return text;
}

}  // namespace wheelwright::words

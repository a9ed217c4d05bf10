// SPDX-License-Identifier: Apache-2.0
#include "results/words/commission_words.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "commission/assumptions.hpp"
#include "commission/at_risk/at_risk.hpp"
#include "commission/at_risk/pose_at_risk.hpp"
#include "commission/physical.hpp"
#include "core/statistics.hpp"
#include "results/words/detect_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::words {
namespace {

Model model_of(const Commissioning& result) {
  Model model;
  for (const commission::ParameterResult& r : result.parameters) {
    model.parameters.push_back(r.parameter);
  }
  return model;
}

// θ_L = r·m is told as such.
std::string label(const model::Parameter& parameter) {
  return parameter.name == "r_" + parameter.physical ? "r·" + spaced(parameter.physical) : spaced(parameter.name);
}

// Interval that decides on the digits of a number: a prior bound is wide, and says nothing of what is known.
std::pair<double, double> uncertainty(const ParameterView& v) {
  if ((v.lower_is_prior || v.upper_is_prior) && v.estimate && v.spread) {
    return {*v.estimate - *v.spread, *v.estimate + *v.spread};
  }
  return {v.lower, v.upper};
}

ParameterView theta_view(const Commissioning& result, const commission::ParameterResult& r) {
  ParameterView view{.name = label(r.parameter),
                     .unit = commission::parameter_unit(result.model.robot, r.parameter),
                     .estimate = r.estimate,
                     .spread = {},
                     .lower = r.lower,
                     .upper = r.upper,
                     .centre = r.chebyshev,
                     .nominal = {},
                     .lower_is_prior = r.lower_is_prior,
                     .upper_is_prior = r.upper_is_prior,
                     .has_set = result.status != Commissioning::Status::empty,
                     .warrant = r.warrant,
                     .at_risk = {}};
  if (result.at_risk && result.at_risk->set) {
    view.at_risk = result.at_risk->set->hull().sides[static_cast<std::size_t>(&r - result.parameters.data())];
  }
  if (r.estimate && r.standard_error) {
    view.spread = core::student_quantile(0.95, std::max(result.residuals.freedom, 1.0)) * *r.standard_error;
  }
  return view;
}

ParameterView physical_view(ParameterView view, const commission::PhysicalScale& scale,
                            const model::Parameter& parameter) {
  const auto physical = [&](double theta) { return scale.scale * theta - scale.offset; };
  view.name = spaced(parameter.physical);
  view.unit = parameter.physical_unit;
  view.lower = physical(view.lower);
  view.upper = physical(view.upper);
  view.centre = physical(view.centre);
  if (view.estimate) {
    view.estimate = physical(*view.estimate);
  }
  if (view.spread) {
    view.spread = std::abs(scale.scale) * *view.spread;
  }
  if (view.at_risk) {
    view.at_risk = Interval{scale.scale, scale.scale} * *view.at_risk - Interval{scale.offset, scale.offset};
  }
  if (scale.scale < 0.0) {
    std::swap(view.lower, view.upper);
    std::swap(view.lower_is_prior, view.upper_is_prior);
  }
  return view;
}

}  // namespace

std::string risk_remark(const commission::RiskSet& set) {
  return fmt::format(
      "At a stated risk: the true values lie inside all of these intervals, unless a chance of {:g} came "
      "true; for errors that have no more than the {}, whatever their law.",
      set.risk,
      set.warrant == core::Warrant::guaranteed ? "declared bias"
                                               : "bias and deviation that were estimated from this log");
}

std::string estimate_text(const ParameterView& view) {
  const auto [low, high] = uncertainty(view);
  return view.estimate ? beside(*view.estimate, low, high) : "–";
}

std::string centre_text(const ParameterView& view) {
  const auto [low, high] = uncertainty(view);
  const bool known = view.has_set && !(view.lower_is_prior && view.upper_is_prior);
  return known ? beside(view.centre, low, high) : "–";
}

bool physical_values_unknown(const Commissioning& result) {
  return !commission::physical_scales(result.model.robot, model_of(result)).has_value();
}

std::vector<ParameterViews> parameter_views(const Commissioning& result) {
  const auto scales = commission::physical_scales(result.model.robot, model_of(result));
  std::vector<ParameterViews> views;
  for (std::size_t j = 0; j < result.parameters.size(); ++j) {
    const commission::ParameterResult& r = result.parameters[j];
    ParameterViews v{.theta = theta_view(result, r), .physical = {}};
    if (scales) {
      const commission::PhysicalScale& scale = (*scales)[j];
      const auto nominal = result.model.robot.nominal.find(r.parameter.physical);
      const bool known = nominal != result.model.robot.nominal.end();
      if (known) {
        v.theta.nominal = (nominal->second + scale.offset) / scale.scale;
      }
      if (r.parameter.physical != r.parameter.name || scale.scale != 1.0 || scale.offset != 0.0) {
        v.physical = physical_view(v.theta, scale, r.parameter);
        v.physical->nominal = known ? std::optional(nominal->second) : std::nullopt;
      }
    }
    views.push_back(std::move(v));
  }
  return views;
}

std::string output_name(const Model& model, std::size_t i) {
  return i < model.outputs.size() ? spaced(model.outputs[i]) : "output " + std::to_string(i + 1);
}

std::string output_unit_of(const Robot& robot, const Model& model, std::size_t i) {
  return i < model.output_units.size() ? commission::output_unit(robot, model.output_units[i]) : std::string();
}

namespace {

using Status = Commissioning::Status;

// Above this κ (a change of the wheel radii by 22 %) thresholds are called coarse.
constexpr double coarse_kappa = 0.5;

// Below this utilisation a threshold is called one that can hardly fire.
constexpr double idle_utilisation = 0.1;

std::size_t false_alarms(const Commissioning& result) {
  std::size_t sum = 0;
  for (const commission::OutputValidation& v : result.validation) {
    sum += v.outside;
  }
  return sum;
}

std::size_t held_out_instants(const Commissioning& result) {
  std::size_t most = 0;
  for (const commission::OutputValidation& v : result.validation) {
    most = std::max(most, v.instants);
  }
  return most;
}

std::vector<std::string> idle_outputs(const Commissioning& result) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < result.validation.size(); ++i) {
    if (result.validation[i].instants > 0 && result.validation[i].utilisation < idle_utilisation) {
      names.push_back(output_name(result.model.model, i));
    }
  }
  return names;
}

std::string bounds_text(const ParameterView& v, bool little) {
  const std::string word(little ? "bounds" : core::warrant_word(v.warrant));
  const auto [lower, upper] = outward(v.lower, v.upper);
  if (v.lower_is_prior && v.upper_is_prior) {
    return "bounded by the prior alone";
  }
  if (v.lower_is_prior || v.upper_is_prior) {
    return v.lower_is_prior ? word + " at most " + upper : word + " at least " + lower;
  }
  return word + " " + lower + " to " + upper;
}

std::string estimates(const Commissioning& result) {
  std::vector<std::string> items;
  const std::vector<ParameterViews> views = parameter_views(result);
  for (std::size_t j = 0; j < views.size(); ++j) {
    const ParameterView& v = views[j].best();
    if (v.estimate && result.parameters[j].excitation != identify::Excitation::not_excited) {
      items.push_back(with_unit(v.name + " " + estimate_text(v), v.unit) + " (" +
                      bounds_text(v, !result.little.why.empty()) + ")");
    }
  }
  if (physical_values_unknown(result)) {
    return "In units of the effort that was logged, since the motor’s constants are not given: " +
           core::enumerated(items) + ".";
  }
  return core::capital(core::enumerated(items)) + ".";
}

std::string footing(const Commissioning& result) {
  if (!result.little.why.empty()) {
    return std::string(little_meaning);
  }
  std::vector<std::string> declared, estimated, broken;
  for (std::size_t i = 0; i < result.noise.size(); ++i) {
    (result.noise[i].origin == core::NoiseOrigin::declared ? declared : estimated)
        .push_back(output_name(result.model.model, i));
  }
  for (const core::Assumption& a : result.assumptions) {
    if (a.verdict == core::AssumptionVerdict::fails && a.id != commission::kNoiseAverages &&
        a.id != commission::kPoseNoiseAverages) {
      broken.push_back(a.statement);
    }
  }
  if (!broken.empty()) {
    return "The bounds stand on assumptions of which the log contradicts these: " +
           fmt::format("{}", fmt::join(broken, " "));
  }
  if (estimated.empty()) {
    return result.noise_mode == filter::NoiseMode::worst_case
               ? "The guarantee stands on the sensors’ declared noise bounds: it holds for every noise within them, "
                 "while "
                 "the assumptions listed below hold."
               : "The bounds stand on the sensors’ declared noise bounds and on their noise being independent from "
                 "sample to sample, at the stated confidence.";
  }
  if (declared.empty()) {
    return "The bounds stand on noise bounds that were extrapolated from the residuals of this log: they hold while "
           "noise and driving stay like it.";
  }
  return "The bounds stand on the sensors’ declared noise for " + core::enumerated(declared) +
         ", and on bounds extrapolated from the residuals of this log for " + core::enumerated(estimated) + ".";
}

std::string held_out(const Commissioning& result) {
  const std::size_t instants = held_out_instants(result);
  if (instants == 0) {
    return "There was no held-out driving to try the thresholds on: their false-alarm rate is not known.";
  }
  const std::size_t alarms = false_alarms(result);
  double most = 0.0;
  for (const commission::OutputValidation& v : result.validation) {
    most = std::max(most, v.utilisation);
  }
  if (alarms == 0) {
    return fmt::format(
        "On {} instants of driving that the model had not seen there was no false alarm; the residual used "
        "at most {} of its threshold.",
        count(instants), percent(most));
  }
  return fmt::format(
      "On {} instants of driving that the model had not seen, the residual left its threshold {} in error.",
      count(instants), alarms == 1 ? "once" : count(alarms) + " times");
}

std::string sees(const Commissioning& result) {
  const std::optional<double> kappa = commission::smallest_certain_kappa(result.validation);
  if (!kappa) {
    return "On this driving no change of scale, however large, is certain to be seen: the thresholds are wider than "
           "all that the robot did.";
  }
  if (*kappa > commission::whole_effort) {
    return "On this driving no change of scale that is smaller than the forces themselves is certain to be seen: the "
           "thresholds are wider than they.";
  }
  if (model::on_two_wheels(result.model.robot)) {
    return fmt::format(
        "The smallest change of both wheel radii that is certain to be seen is {}, at the best moment of the held-out "
        "driving (|δ1|/r = √(1+κ) − 1 with κ = {}); `wheelwright margins` says it for other faults, and while doing "
        "what.",
        percent(radius_change(*kappa)), number(*kappa));
  }
  return fmt::format(
      "The smallest change of all forces by one factor that is certain to be seen is {}: ζ = κ·Yθ with κ = {}.",
      percent(*kappa), number(*kappa));
}

std::string unseen(const Commissioning& result) {
  std::vector<std::string> names, todo;
  const std::vector<ParameterViews> views = parameter_views(result);
  for (std::size_t j = 0; j < views.size(); ++j) {
    const commission::ParameterResult& r = result.parameters[j];
    if (r.excitation == identify::Excitation::not_excited) {
      names.push_back(views[j].best().name);
      if (!r.parameter.excite.empty() && std::find(todo.begin(), todo.end(), r.parameter.excite) == todo.end()) {
        todo.push_back(r.parameter.excite);
      }
    }
  }
  if (names.empty()) {
    return {};
  }
  std::string text = "The log says nothing about " + core::enumerated(names) + ".";
  if (!todo.empty()) {
    text += " What to do: " + core::enumerated(todo) +
            " (`wheelwright design --for bounds` plans such a drive), and commission again.";
  }
  if (result.has_model()) {
    text += " Until then their bounds are the prior’s, and thresholds are wide wherever they matter.";
  }
  return text;
}

std::string contradiction(const Commissioning& result) {
  std::vector<double> t;
  for (const bounds::WeightedRow& w : result.feasible.contradiction) {
    if (!w.row.origin.is_prior) {
      t.push_back(w.row.origin.t);
    }
  }
  if (t.empty()) {
    return {};
  }
  return fmt::format("{} of the log already contradict{} the model by {} (the table “Contradiction” gives {}).",
                     core::capital(t.size() == 1 ? "one sample" : plural(t.size(), "sample")), t.size() == 1 ? "s" : "",
                     t.size() == 1 ? "itself" : "themselves", t.size() == 1 ? "it" : "them");
}

// What holds at the stated risk, or why nothing is said; empty where the robot file does not ask for it.
std::string at_risk(const Commissioning& result) {
  const auto assumption = std::ranges::find(result.assumptions, commission::kNoiseAverages, &core::Assumption::id);
  if (assumption == result.assumptions.end()) {
    return {};
  }
  if (!result.at_risk || !result.at_risk->set) {
    return fmt::format("Nothing is said at a stated risk, the {} answer stands alone: {}.",
                       core::warrant_word(commission::interval_warrant(result)), assumption->detail);
  }
  std::vector<std::string> items;
  for (const ParameterViews& views : parameter_views(result)) {
    const ParameterView& v = views.best();
    if (v.at_risk) {
      const auto [lower, upper] = outward(v.at_risk->lower, v.at_risk->upper);
      items.push_back(with_unit(v.name + " " + lower + " to " + upper, v.unit));
    }
  }
  std::string text = fmt::format(
      "At a risk of {:g}{}: {}.", result.at_risk->risk,
      result.at_risk->warrant == core::Warrant::guaranteed ? "" : ", while errors stay as this log shows them",
      core::enumerated(items));
  std::vector<std::string> seen;
  for (const commission::RiskReach& reach : result.reach) {
    const bool share = reach.unit == "1";
    if (reach.weight.shape == detector::SumWeight::Shape::parameter || reach.size.size() < 2 ||
        !std::isfinite(reach.size[1]) || (share && reach.size[1] >= 1.0)) {
      continue;
    }
    const std::string& joint = result.model.model.joints[reach.weight.which].torque;
    seen.push_back(share ? fmt::format("a loss of {} of {}", percent(reach.size[1], 2), joint)
                         : fmt::format("a bias of {} in {}", with_unit(number(reach.size[1], 2), reach.unit), joint));
  }
  if (!seen.empty()) {
    text += fmt::format(
        " With at most one false alarm in ten years, {} are certain to be seen within {} from half of "
        "all moments of such a drive.",
        core::enumerated(seen), with_unit(fmt::format("{:g}", result.reach.front().within[1]), "s"));
  }
  return text;
}

// The same of the kinematic residual.
std::string pose_at_risk(const Commissioning& result) {
  const auto assumption = std::ranges::find(result.assumptions, commission::kPoseNoiseAverages, &core::Assumption::id);
  if (assumption == result.assumptions.end() || !result.kinematic.model) {
    return {};
  }
  const detector::KinematicModel& model = *result.kinematic.model;
  if (!model.at_risk) {
    return fmt::format("Nothing is said of the pose at a stated risk, the {} answer stands alone: {}.",
                       core::warrant_word(model.warrant), assumption->detail);
  }
  std::vector<std::string> items;
  const auto names = model.measurement.parameters(), units = model.measurement.parameter_units();
  for (std::size_t j = 0; j < names.size(); ++j) {
    const Interval side = model.at_risk->box.sides[j];
    const auto [lower, upper] = outward(side.lower, side.upper);
    items.push_back(with_unit(names[j] + " " + lower + " to " + upper, unit_of(units[j])));
  }
  std::ranges::for_each(items, [](std::string& item) { std::ranges::replace(item, '_', ' '); });
  return fmt::format("Of the pose, at a risk of {:g}: {}.", model.at_risk->risk, core::enumerated(items));
}

// Each contradiction that withdraws a model (or does not) with what to do about it.
void tell_contradictions(const Commissioning& result, bool withdraws, std::vector<std::string>& out) {
  for (const commission::LogContradiction& c : result.contradictions) {
    if (c.withdraws == withdraws) {
      out.push_back(fmt::format("{}. What to do: {}.", core::capital(c.sentence), c.next));
    }
  }
}

std::vector<std::string> words_with_model(const Commissioning& result) {
  std::vector<std::string> out = {estimates(result)};
  tell_contradictions(result, false, out);
  if (std::string missing = unseen(result); !missing.empty()) {
    out.push_back(std::move(missing));
  }
  out.push_back(footing(result));
  out.push_back(held_out(result));
  const std::optional<double> kappa = commission::smallest_certain_kappa(result.validation);
  const bool nothing = commission::sees_nothing(result.validation);
  out.push_back(sees(result) + (kappa && !nothing && result.model.warrant != core::Warrant::guaranteed
                                    ? " " + certain_meaning(result.model.warrant)
                                    : ""));
  for (std::string text : {at_risk(result), pose_at_risk(result)}) {
    if (!text.empty()) {
      out.push_back(std::move(text));
    }
  }
  if (false_alarms(result) > 0) {
    out.emplace_back(
        "What to do: look at those moments in the log; where they are no fault, commission on longer and more "
        "varied driving, or declare the sensors’ noise in the robot file.");
  } else if (const auto idle = idle_outputs(result); !idle.empty()) {
    out.push_back(
        fmt::format("The threshold of {} is much wider than its residual and can hardly fire: declared noise "
                    "bounds that are smaller, where the sensors allow it, would tighten it.",
                    core::enumerated(idle)));
  } else if (!nothing && kappa.value_or(coarse_kappa) >= coarse_kappa) {
    out.emplace_back(
        "Only coarse faults are certain to be seen: a longer log with stronger acceleration and tighter curves, or a "
        "quieter effort signal, would narrow the thresholds; `wheelwright design --for bounds` plans such a drive.");
  }
  return out;
}

}  // namespace

double radius_change(double kappa) { return std::sqrt(1.0 + kappa) - 1.0; }

Standing standing(const Commissioning& result) {
  if (!result.has_model()) {
    return Standing::bad;
  }
  const bool clean = result.status == Status::done && held_out_instants(result) > 0 && false_alarms(result) == 0 &&
                     commission::smallest_certain_kappa(result.validation).value_or(coarse_kappa) < coarse_kappa &&
                     idle_outputs(result).empty() && result.little.why.empty() &&
                     std::ranges::none_of(result.contradictions, &commission::LogContradiction::demotes);
  return clean ? Standing::good : Standing::caution;
}

std::string verdict(const Commissioning& result) {
  const std::string instead = result.little.why.empty()
                                  ? ""
                                  : fmt::format("Little was learned: {}. What to do: {}.", result.little.why,
                                                fmt::join(result.little.remedies, "; "));
  if (!instead.empty() && result.has_model()) {
    return instead;
  }
  switch (result.status) {
    case Status::done:
      return standing(result) == Standing::good ? "Commissioned: the model can watch this robot."
                                                : "Commissioned, with something to be read first.";
    case Status::partial: return "Commissioned in part: the log does not show every parameter.";
    case Status::empty: return "No model: the log contradicts the model within the declared noise.";
    case Status::nothing: return "No model: the log shows none of the parameters.";
    case Status::contradicted: return "No model: the log contradicts what a model takes for granted.";
  }
  return {};
}

std::vector<std::string> commission_words(const Commissioning& result) {
  switch (result.status) {
    case Status::done:
    case Status::partial: return words_with_model(result);
    case Status::nothing: {
      std::vector<std::string> out;
      if (std::string missing = unseen(result); !missing.empty()) {
        out.push_back(std::move(missing));
      } else {
        out.emplace_back(
            "The log says nothing about any parameter. What to do: drive with changing speed and in curves, "
            "and commission again.");
      }
      out.push_back(fmt::format("The log holds {} rows over {}; the raw signals below show how the robot moved.",
                                count(result.survey.rows), with_unit(number(result.survey.seconds), "s")));
      out.emplace_back("No useful threshold can be made of this log.");
      return out;
    }
    case Status::contradicted: {
      std::vector<std::string> out;
      tell_contradictions(result, true, out);
      tell_contradictions(result, false, out);
      out.emplace_back("Numbers below are what the log says by itself; no threshold is made of them.");
      return out;
    }
    case Status::empty: {
      std::vector<std::string> out = {fmt::format(
          "No parameters within their prior explain this log while the sensors keep to their noise bounds: these "
          "would have to be {} times as large.",
          number(result.minimax))};
      if (std::string text = contradiction(result); !text.empty()) {
        out.push_back(std::move(text));
      }
      tell_contradictions(result, true, out);
      tell_contradictions(result, false, out);
      out.emplace_back(
          "This means one of three things: a fault during the drive, an effect that the model lacks (payload "
          "that moves, slip, dry friction), or noise bounds in the robot file that are too small.");
      out.emplace_back(
          "What to do: look at the moments named below in the raw signals; check units, geometry and the noise "
          "in the robot file; if they are right, leave that part of the drive out, or let the noise be "
          "estimated.");
      return out;
    }
  }
  return {};
}

}  // namespace wheelwright::words

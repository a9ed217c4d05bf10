// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/local_derivatives.hpp>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/study/bound_rates.hpp>
#include <wheelwright/study/study_case.hpp>

namespace wheelwright::study {
namespace {

struct Sensor {
  const char* name;
  const char* unit;
  model::NoiseBound model::SensorNoise::*bound;
};

constexpr Sensor kSensors[] = {{"wheel_speed", "rad/s", &model::SensorNoise::wheel_speed},
                               {"wheel_angle", "rad", &model::SensorNoise::wheel_angle},
                               {"effort", "", &model::SensorNoise::effort},
                               {"position", "m", &model::SensorNoise::position},
                               {"heading", "rad", &model::SensorNoise::heading}};

// The sensor behind "declared." or "noise.".
const Sensor* sensor_of(std::string_view name) {
  for (const std::string_view family : {"declared.", "noise."}) {
    for (const Sensor& sensor : kSensors) {
      if (name.starts_with(family) && name.substr(family.size()) == sensor.name) {
        return &sensor;
      }
    }
  }
  return nullptr;
}

const char* effort_unit(model::EffortKind kind) {
  return kind == model::EffortKind::torque ? "N·m" : kind == model::EffortKind::current ? "A" : "V";
}

LocalInput prior_input(const RobotAt& at, const Model& model, const std::string& name) {
  constexpr std::string_view kFamily = "prior.", kLower = ".lower", kUpper = ".upper";
  const bool lower = name.ends_with(kLower), upper = name.ends_with(kUpper);
  const std::string physical =
      name.substr(kFamily.size(), name.size() - kFamily.size() - (lower || upper ? kLower.size() : 0));
  const auto found = std::ranges::find(model.parameters, physical, &model::Parameter::physical);
  check::that(found != model.parameters.end(), "input " + name, "prior.NAME of a parameter of the model");
  const model::PriorBox box = model::prior_box(at.robot, model);
  const auto j = static_cast<std::size_t>(found - model.parameters.begin());
  const Interval side{box.bounds[j].lower / found->per_physical, box.bounds[j].upper / found->per_physical};
  if (lower) {
    return {name, found->physical_unit, side.lower, PriorRate{physical, 1.0, 1.0, 0.0, 0.0}};
  }
  if (upper) {
    return {name, found->physical_unit, side.upper, PriorRate{physical, 0.0, 0.0, 1.0, 1.0}};
  }
  // A factor of the width: about the geometric mean where both sides are above 0, else about the middle, and a side
  // that is not below 0 stays so.
  if (side.lower > 0.0) {
    const double reach = 0.5 * std::log(side.upper / side.lower);
    return {name, "1", 1.0,
            PriorRate{physical, -reach * side.lower, -reach * side.lower, reach * side.upper, reach * side.upper}};
  }
  const double half = 0.5 * side.width();
  return {name, "1", 1.0, PriorRate{physical, -half, side.lower == 0.0 ? 0.0 : -half, half, half}};
}

}  // namespace

LocalInput local_input(const RobotAt& at, const Model& model, const std::string& name) {
  const Robot& robot = at.robot;
  if (name.starts_with("prior.")) {
    return prior_input(at, model, name);
  }
  if (const Sensor* sensor = sensor_of(name)) {
    const model::NoiseBound& bound = robot.noise.*(sensor->bound);
    check::that(bound.value.has_value(), "input " + name, "a bound in the robot file");
    return {name, sensor->bound == &model::SensorNoise::effort ? effort_unit(robot.effort) : sensor->unit,
            *bound.value};
  }
  if (name == "filter.alpha" || name == "filter.beta") {
    return {name, "1/s", name == "filter.alpha" ? at.filter.alpha : at.filter.beta};
  }
  if (double Robot::*const geometry = length_of(name)) {
    const double length = robot.*geometry;
    check::that(length > 0.0, "input " + name, "a robot with wheels");
    return {name, "m", length};
  }
  check::that(name == "encoder_counts_per_turn", "input " + name,
              "declared.SENSOR, filter.alpha, filter.beta, wheel_radius, track_width, encoder_counts_per_turn, "
              "prior.NAME, prior.NAME.lower or prior.NAME.upper");
  check::that(robot.encoder_counts_per_turn.has_value(), "input " + name, "a value in the robot file");
  return {name, "1", *robot.encoder_counts_per_turn};
}

RobotAt with_input(RobotAt at, const LocalInput& input, double x) {
  if (const Sensor* sensor = sensor_of(input.name)) {
    (at.robot.noise.*(sensor->bound)).value = x;
  } else if (input.name == "filter.alpha") {
    at.filter.alpha = x;
  } else if (input.name == "filter.beta") {
    if (!at.robot.filter.alpha) {
      at.filter.alpha *= x / at.filter.beta;
    }
    at.filter.beta = x;
  } else if (double Robot::*const geometry = length_of(input.name)) {
    at.robot.*geometry = x;
  } else {
    at.robot.encoder_counts_per_turn = x;
  }
  return at;
}

std::vector<std::string> robot_inputs(const RobotAt& at) {
  std::vector<std::string> names;
  for (const Sensor& sensor : kSensors) {
    if ((at.robot.noise.*sensor.bound).value) {
      names.push_back(std::string("declared.") + sensor.name);
    }
  }
  if (at.robot.encoder_counts_per_turn) {
    names.emplace_back("encoder_counts_per_turn");
  }
  names.insert(names.end(), {"filter.alpha", "filter.beta"});
  if (model::on_two_wheels(at.robot)) {
    names.insert(names.end(), {"wheel_radius", "track_width"});
  }
  return names;
}

namespace {

ParameterDerivative join(const BoundRate& lower, const BoundRate& upper, const LocalInput& input, double width) {
  ParameterDerivative d;
  d.lower = lower.value;
  d.upper = upper.value;
  d.width = {upper.value.left - lower.value.left, upper.value.right - lower.value.right};
  d.differentiable = lower.why_not.empty() && upper.why_not.empty();
  d.why_not = lower.why_not + (lower.why_not.empty() || upper.why_not.empty() ? "" : "; ") + upper.why_not;
  if (d.differentiable && width > 0.0 && input.value != 0.0) {
    d.elasticity = input.value / width * 0.5 * (d.width.left + d.width.right);
  }
  return d;
}

std::vector<std::string> default_inputs(const RobotAt& at, const Model& model, const HullOptima& optima) {
  std::vector<std::string> names = robot_inputs(at);
  std::erase_if(names, [&](const std::string& name) { return local_input(at, model, name).value == 0.0; });
  const std::vector<bool> declared = model::prior_box(at.robot, model).declared;
  for (std::size_t j = 0; j < model.p(); ++j) {
    for (const bounds::Side side : {bounds::Side::lower, bounds::Side::upper}) {
      bool holds = declared[j];
      for (const auto* bounds : {&optima.lower, &optima.upper}) {
        for (const HullOptimum& optimum : *bounds) {
          for (const bounds::WeightedRow& active : optimum.active) {
            const bounds::RowOrigin& origin = active.row.origin;
            holds = holds || (origin.is_prior && origin.parameter == j && origin.side == side);
          }
        }
      }
      if (holds) {
        names.push_back("prior." + model.parameters[j].physical + (side == bounds::Side::lower ? ".lower" : ".upper"));
      }
    }
  }
  return names;
}

}  // namespace

LocalSensitivity local_derivatives(LogSource& log, const Commissioning& c, const LocalOptions& options) {
  check::that(options.step > 0.0 && options.step <= 0.01, "step", "a relative step in (0, 0.01]");
  LocalSensitivity result;
  result.warrant = c.model.warrant;
  const Model& model = c.model.model;
  for (const commission::ParameterResult& p : c.parameters) {
    result.parameters.push_back(p.parameter.name);
    result.units.push_back(p.parameter.unit);
    result.lower.push_back(p.lower);
    result.upper.push_back(p.upper);
  }
  if (c.feasible.status == FeasibleSet::Status::empty || !c.feasible.polytope) {
    result.notes.emplace_back("the feasible set is empty: there are no bounds whose derivatives could be taken");
    return result;
  }
  const auto is_union = [](const FeasibleSet& set) { return set.sign_parts > 1 || set.convexified; };
  if (is_union(c.feasible) || std::ranges::any_of(c.earlier, is_union, &commission::EarlierSet::set)) {
    result.notes.emplace_back(
        "signs of parameters with noisy columns are open: the set is a union of parts, and derivatives of its bounds "
        "are not offered");
    return result;
  }
  const RobotAt at{c.model.robot, c.model.filter};
  const std::vector<BoundPass> passes = bound_passes(log, c, options.confidence);
  const HullOptima& optima = passes.back().optima;
  result.notes.emplace_back(
      "instants, columns, parameters, outliers left out and the number of passes are held as commissioning chose them");
  if (!noise_is_declared(c)) {
    result.notes.emplace_back(
        "noise is estimated from the log: the rows' error bounds are held fixed, how the estimate itself follows an "
        "input is not seen");
  }

  const std::vector<std::string> names = options.inputs.empty() ? default_inputs(at, model, optima) : options.inputs;
  for (const std::string& name : names) {
    const LocalInput input = local_input(at, model, name);
    LocalDerivative derivative{input.name, input.unit, input.value, {}};
    const BoundRates rates = bound_rates(log, c, passes, input, options.step, options.confidence);
    for (std::size_t j = 0; j < model.p(); ++j) {
      derivative.parameters.push_back(join(rates.lower[j], rates.upper[j], input, result.upper[j] - result.lower[j]));
    }
    result.inputs.push_back(std::move(derivative));
  }
  result.optima = optima;
  log.rewind();
  return result;
}

std::vector<std::string> not_differentiable(const LocalSensitivity& result) {
  std::vector<std::string> sentences;
  for (const LocalDerivative& input : result.inputs) {
    for (std::size_t j = 0; j < input.parameters.size(); ++j) {
      if (!input.parameters[j].differentiable) {
        sentences.push_back(fmt::format("bounds of {} are not differentiable in {}: {}", result.parameters[j],
                                        input.input, input.parameters[j].why_not));
      }
    }
  }
  return sentences;
}

}  // namespace wheelwright::study

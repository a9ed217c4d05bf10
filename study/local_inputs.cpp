// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/local_inputs.hpp>

#include <algorithm>
#include <cmath>
#include <string_view>

#include <wheelwright/core/check.hpp>

namespace wheelwright {
namespace {

struct Sensor {
  const char* name;
  const char* unit;
  NoiseBound SensorNoise::*bound;
};

constexpr Sensor kSensors[] = {{"wheel_speed", "rad/s", &SensorNoise::wheel_speed},
                               {"wheel_angle", "rad", &SensorNoise::wheel_angle},
                               {"effort", "", &SensorNoise::effort},
                               {"position", "m", &SensorNoise::position},
                               {"heading", "rad", &SensorNoise::heading}};

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

const char* effort_unit(EffortKind kind) {
  return kind == EffortKind::torque ? "N·m" : kind == EffortKind::current ? "A" : "V";
}

LocalInput prior_input(const RobotAt& at, const Model& model, const std::string& name) {
  constexpr std::string_view kFamily = "prior.", kLower = ".lower", kUpper = ".upper";
  const bool lower = name.ends_with(kLower), upper = name.ends_with(kUpper);
  const std::string physical =
      name.substr(kFamily.size(), name.size() - kFamily.size() - (lower || upper ? kLower.size() : 0));
  const auto found = std::ranges::find(model.parameters, physical, &Parameter::physical);
  check::that(found != model.parameters.end(), "input " + name, "prior.NAME of a parameter of the model");
  const PriorBox box = prior_box(at.robot, model);
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
    const NoiseBound& bound = robot.noise.*(sensor->bound);
    check::that(bound.value.has_value(), "input " + name, "a bound in the robot file");
    return {name, sensor->bound == &SensorNoise::effort ? effort_unit(robot.effort) : sensor->unit, *bound.value};
  }
  if (name == "filter.alpha" || name == "filter.beta") {
    return {name, "1/s", name == "filter.alpha" ? at.filter.alpha : at.filter.beta};
  }
  if (name == "wheel_radius" || name == "track_width") {
    const double length = name == "wheel_radius" ? robot.wheel_radius : robot.track_width;
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
  } else if (input.name == "wheel_radius") {
    at.robot.wheel_radius = x;
  } else if (input.name == "track_width") {
    at.robot.track_width = x;
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
  if (at.robot.model != "single_axis") {
    names.insert(names.end(), {"wheel_radius", "track_width"});
  }
  return names;
}

}  // namespace wheelwright

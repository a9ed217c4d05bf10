// SPDX-License-Identifier: Apache-2.0
#include "model/robot.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.hpp"
#include "model/differential_drive.hpp"
#include "model/effect_law.hpp"
#include "model/single_axis.hpp"

namespace wheelwright::model {
namespace {

// An unknown effort constant (A or V per N·m) is taken to lie below this in a default prior.
constexpr double widest_effort_constant = 1e3;

constexpr std::string_view kDrive = "differential_drive", kAxis = "single_axis";

// Everything the robot's kind of model can have, before the robot's own choice of parameters and its effects' terms.
Model full_model(const Robot& robot) {
  if (robot.model == kDrive) {
    Model model = DifferentialDrive{robot.wheel_radius, drive_geometry(robot).track_width, robot.lever_arm_is_track,
                                    robot.anisotropic_friction, !has_effect(robot, "coulomb_asymmetric")}
                      .model();
    apply_geometry(model, robot);
    return model;
  }
  if (robot.model == kAxis) {
    return SingleAxis{.coulomb = true, .offset = true}.model();
  }
  throw InvalidArgument("model is '" + robot.model + "': expected differential_drive or single_axis");
}

void require_parameter(const Model& model, const std::string& name, const std::string& where) {
  std::string known;
  for (const Parameter& parameter : model.parameters) {
    if (parameter.physical == name) {
      return;
    }
    known += (known.empty() ? "" : ", ") + parameter.physical;
  }
  throw InvalidArgument(where + ": the model " + model.name + " has no parameter '" + name + "', expected one of " +
                        known);
}

// The model with those parameters only that `keep` names, in the model's order.
Model select(const Model& model, const std::vector<std::string>& keep) {
  Model selected = model;
  selected.parameters.clear();
  selected.terms.clear();
  for (std::size_t j = 0; j < model.p(); ++j) {
    if (std::find(keep.begin(), keep.end(), model.parameters[j].physical) == keep.end()) {
      continue;
    }
    for (Term term : model.terms) {
      if (term.parameter == j) {
        term.parameter = selected.parameters.size();
        selected.terms.push_back(term);
      }
    }
    selected.parameters.push_back(model.parameters[j]);
  }
  return selected;
}

// The model with the parameters of `more` after its own.
void append(Model& model, const Model& more) {
  for (Term term : more.terms) {
    term.parameter += model.p();
    model.terms.push_back(term);
  }
  model.parameters.insert(model.parameters.end(), more.parameters.begin(), more.parameters.end());
}

}  // namespace

const std::string& effort_column(const Joint& joint, EffortKind kind) {
  return kind == EffortKind::torque ? joint.torque : kind == EffortKind::current ? joint.current : joint.voltage;
}

std::string_view to_string(SpeedFilterKind kind) {
  switch (kind) {
    case SpeedFilterKind::exponential: return "exponential";
    case SpeedFilterKind::lag: return "lag";
    case SpeedFilterKind::mean: return "mean";
  }
  return "";
}

double RobotEffect::value(const std::string& parameter) const {
  const auto found = parameters.find(parameter);
  check::that(found != parameters.end(), "effects." + name, "the parameter " + parameter);
  return 0.5 * (found->second.lower + found->second.upper);
}

bool operator==(const RobotEffect& a, const RobotEffect& b) {
  const auto same = [](const auto& x, const auto& y) {
    return x.first == y.first && x.second.lower == y.second.lower && x.second.upper == y.second.upper;
  };
  return a.name == b.name && std::ranges::equal(a.parameters, b.parameters, same);
}

// Effort at the wheel per unit of torque, where the motor's constants tell: 1/(N k_t) for currents, R/(N k_t) for
// voltages (the back-EMF then belongs to the viscous terms).
std::optional<double> effort_per_torque(const Robot& robot) {
  if (robot.effort == EffortKind::torque) {
    return 1.0;
  }
  if (!robot.motor || !robot.motor->torque_constant) {
    return std::nullopt;
  }
  const double torque_per_current = check::positive(*robot.motor->torque_constant, "motor.torque_constant") *
                                    check::positive(robot.motor->gear_ratio, "motor.gear_ratio");
  if (robot.effort == EffortKind::current) {
    return 1.0 / torque_per_current;
  }
  if (!robot.motor->resistance) {
    return std::nullopt;
  }
  return check::positive(*robot.motor->resistance, "motor.resistance") / torque_per_current;
}

std::vector<std::string> possible_parameters(const Robot& robot) {
  std::vector<std::string> names;
  for (const Parameter& parameter : full_model(robot).parameters) {
    names.push_back(parameter.physical);
  }
  return names;
}

Model make_model(const Robot& robot) {
  validate_effects(robot);
  const Model full = full_model(robot);
  for (const auto& [name, value] : robot.nominal) {
    require_parameter(full, name, "nominal");
    check::finite(value, "nominal." + name);
  }
  for (const auto& [name, bounds] : robot.prior) {
    require_parameter(full, name, "prior");
    check::that(bounds.lower <= bounds.upper, "prior." + name, "lower <= upper");
  }
  if (robot.parameters) {
    check::that(!robot.parameters->empty(), "parameters", "at least one name");
    for (const std::string& name : *robot.parameters) {
      require_parameter(full, name, "parameters");
    }
  }
  std::vector<std::string> first, last;
  for (const Parameter& parameter : full.parameters) {
    const std::string& name = parameter.physical;
    const bool wanted = robot.parameters && std::ranges::find(*robot.parameters, name) != robot.parameters->end();
    if (parameter.on_request && !effect_prior(robot, name)) {
      if (wanted) {
        last.push_back(name);
      }
    } else if (wanted || !robot.parameters || effect_prior(robot, name)) {
      first.push_back(name);
    }
  }
  Model model = select(full, first);
  add_effect_terms(model, robot);
  append(model, select(full, last));
  if (const std::optional<double> scale = effort_per_torque(robot)) {
    for (Parameter& parameter : model.parameters) {
      parameter.per_physical *= *scale;
    }
  }
  validate(model);
  return model;
}

PriorBox prior_box(const Robot& robot, const Model& model) {
  const bool scale_known = effort_per_torque(robot).has_value();
  PriorBox box;
  for (const Parameter& parameter : model.parameters) {
    const auto found = robot.prior.find(parameter.physical);
    const std::optional<Interval> of_effect = effect_prior(robot, parameter.physical);
    const bool own = found != robot.prior.end(), declared = own || of_effect.has_value();
    Interval physical = own ? found->second : of_effect.value_or(parameter.prior);
    if (declared) {
      check::that(physical.lower <= physical.upper, "prior." + parameter.physical, "lower <= upper");
      check::that(scale_known, "prior." + parameter.physical,
                  "effort as torque, or the motor's constants, to make effort of " + parameter.physical_unit);
    } else if (!scale_known) {
      physical = {physical.lower * widest_effort_constant, physical.upper * widest_effort_constant};
    }
    const Interval scale = {parameter.per_physical, parameter.per_physical};
    Interval bound = scale * physical;
    if (physical.lower == 0.0 && parameter.per_physical > 0.0) {
      bound.lower = 0.0;
    }
    box.bounds.push_back(bound);
    box.declared.push_back(declared);
  }
  return box;
}

bool on_two_wheels(const Robot& robot) { return robot.model == kDrive; }

Robot with_column_errors(Robot robot, const std::vector<core::ColumnError>& errors) {
  const SensorNoise declared = robot.noise;
  for (const core::ColumnError& of : errors) {
    const auto widen = [&](NoiseBound SensorNoise::*kind) {
      if (const std::optional<double> bound = (declared.*kind).value) {
        NoiseBound& widened = robot.noise.*kind;
        widened.value = std::max(*widened.value, *bound + of.bound);
        if (const std::optional<double> bias = (declared.*kind).bias) {  // interpolation does not average out
          widened.bias = std::max(*widened.bias, *bias + of.bound);
        }
      }
    };
    const std::string& name = of.column;
    if (name.starts_with("omega") || name == "velocity") {
      widen(&SensorNoise::wheel_speed);
    } else if (name.starts_with("phi")) {
      widen(&SensorNoise::wheel_angle);
    } else if (name.starts_with("tau") || name.starts_with("current") || name.starts_with("voltage") ||
               name == "effort") {
      widen(&SensorNoise::effort);
    } else if (name == "x" || name == "y" || name == "position") {
      widen(&SensorNoise::position);
    } else if (name == "theta") {
      widen(&SensorNoise::heading);
    } else if (name == "gyro_z") {
      widen(&SensorNoise::gyro);
    }
  }
  return robot;
}

}  // namespace wheelwright::model

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/model/effect_law.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/limits.hpp>

namespace wheelwright {
namespace {

using Parameters = std::vector<EffectParameterLaw>;

constexpr double longest_time = 10.0;  // s: of a lag, a delay, an offset
constexpr double largest_share = 0.5;  // of a radius, a track, an encoder's scale
constexpr double longest_drift = 1e6;  // s

EffectParameterLaw linear(const char* name, const char* unit) { return {name, unit, true}; }
EffectParameterLaw not_negative(const char* name, const char* unit) { return {name, unit, true, 0.0}; }
EffectParameterLaw shape(const char* name, const char* unit, double upper = kInfinity) {
  return {name, unit, false, 0.0, upper, true};
}
EffectParameterLaw share(const char* name) { return {name, "1", false, -largest_share, largest_share}; }
EffectParameterLaw fixed(const char* name, const char* unit) { return {name, unit, false}; }

EffectLaw terms(const char* name, Parameters parameters, Parameters of_axis = {}) {
  return {name, EffectMechanism::term, std::move(parameters), std::move(of_axis), {}};
}

EffectLaw effort(const char* name, const Parameters& parameters, bool axis) {
  return {name, EffectMechanism::effort, parameters, axis ? parameters : Parameters{}, {}};
}

EffectLaw geometry(const char* name, Parameters parameters) {
  return {name, EffectMechanism::geometry, std::move(parameters), {}, {}};
}

EffectLaw simulation(const char* name, Parameters parameters, const char* remedy) {
  return {name, EffectMechanism::simulation, std::move(parameters), {}, remedy};
}

std::vector<EffectLaw> make_laws() {
  return {
      terms("coulomb", {not_negative("c", "N·m")}, {not_negative("c", "N·m")}),
      terms("coulomb_asymmetric", {not_negative("c_R", "N·m"), not_negative("c_L", "N·m")}),
      terms("stribeck", {linear("c_s", "N·m"), shape("omega_s", "rad/s")},
            {linear("c_s", "N·m"), shape("omega_s", "rad/s")}),
      terms("viscous_asymmetric", {linear("b", "N·m·s/rad")}),
      terms("quadratic_drag", {linear("c", "N·s²/m"), linear("c2", "N·m²·s²/rad²")}, {linear("c", "N·m·s²/rad²")}),
      terms("com_longitudinal", {linear("a", "m")}),
      terms("com_lateral", {linear("b", "m")}),
      effort("torque_gain_asymmetric", {share("g")}, false),
      terms("torque_bias", {linear("b_R", "N·m"), linear("b_L", "N·m")}, {linear("b", "N·m")}),
      terms("slope", {linear("g_x", "m/s²"), linear("g_y", "m/s²")}),
      effort("actuator_lag", {shape("T", "s", longest_time)}, true),
      effort("delay", {shape("T_d", "s", longest_time)}, true),
      effort("sensor_time_offset", {shape("dt", "s", longest_time)}, true),
      effort("torque_deadzone", {shape("b", "N·m")}, true),
      effort("saturation", {shape("tau_max", "N·m")}, true),
      simulation(
          "backlash", {shape("gap", "rad", 1.0)},
          "where a wheel stands inside its play cannot be seen from the log; leave it out of the robot file, and "
          "avoid reversals of torque in the log, or widen noise.effort"),
      simulation(
          "load_friction", {{"k", "1", false, 0.0, largest_share}},
          "its regressor is the measured torque itself, whose noise it shares; leave it out of the robot file and "
          "give coulomb instead, which takes its mean part"),
      simulation(
          "battery_sag", {fixed("k", "1/s"), fixed("R_b", "1/(N·m)")},
          "the battery's charge at the start of a log is not known; leave it out of the robot file, and commission "
          "with a log of the same length and charge, or measure the current instead of the command"),
      simulation("friction_drift", {{"k", "1", false, -1.0, 1.0}, shape("T", "s", longest_drift)},
                 "how warm the robot was at the start of a log is not known; leave it out of the robot file, and "
                 "commission with a log of the warm robot, or give wide priors of friction"),
      terms("caster_drag", {not_negative("c", "N·m"), shape("p", "m")}),
      terms("lateral_scrub", {linear("mu", "N·m²")}),
      simulation("wheel_out_of_round",
                 {fixed("A_R", "N·m"), fixed("B_R", "N·m"), fixed("A_L", "N·m"), fixed("B_L", "N·m")},
                 "the angle at which a log's encoders begin is not known; leave it out of the robot file, and let the "
                 "noise of the effort be estimated, which takes it in"),
      simulation(
          "longitudinal_slip", {shape("stiffness", "N")},
          "the body's speed is not that of the wheels, and depends on the force; leave it out of the robot file, "
          "and commission with a log of gentle driving"),
      geometry("wheel_radius_asymmetric", {share("eps")}),
      geometry("wheel_radius", {share("eps")}),
      geometry("track_width", {share("eps")}),
      geometry("encoder_scale", {share("s_R"), share("s_L")}),
  };
}

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += (text.empty() ? "" : ", ") + name;
  }
  return text;
}

std::string limits_of(const EffectParameterLaw& law) {
  if (law.positive) {
    return std::isfinite(law.upper) ? "a number > 0 and at most " + std::to_string(law.upper) : "a number > 0";
  }
  if (law.lower == 0.0 && !std::isfinite(law.upper)) {
    return "a number >= 0";
  }
  return std::isfinite(law.lower) ? "a number from " + std::to_string(law.lower) + " to " + std::to_string(law.upper)
                                  : "a finite number";
}

void validate_effect(const RobotEffect& effect, const Robot& robot) {
  const EffectLaw& law = effect_law(effect.name);
  const Parameters& known = law.parameters_of(robot.model);
  check::that(!known.empty(), "effects." + effect.name,
              "an effect of the model " + robot.model + ", one of " + joined(effect_names(robot.model)));
  for (const auto& [name, interval] : effect.parameters) {
    const std::string where = "effects." + effect.name + "." + name;
    const auto found = std::ranges::find(known, name, &EffectParameterLaw::name);
    std::string names;
    for (const EffectParameterLaw& parameter : known) {
      names += (names.empty() ? "" : ", ") + parameter.name;
    }
    check::that(found != known.end(), where, "one of " + names);
    check::finite(interval.lower, where);
    check::finite(interval.upper, where);
    check::that(interval.lower <= interval.upper, where, "lower <= upper");
    check::that(found->linear || interval.lower == interval.upper, where, "a single value");
    check::that(
        interval.lower >= found->lower && interval.upper <= found->upper && (!found->positive || interval.lower > 0.0),
        where, limits_of(*found));
    check::that(!found->linear || interval.lower != 0.0 || interval.upper != 0.0, where,
                "a value other than 0, or an interval");
  }
  bool any_linear = false, some_linear = false;
  for (const EffectParameterLaw& parameter : known) {
    const bool given = effect.parameters.contains(parameter.name);
    any_linear = any_linear || parameter.linear;
    some_linear = some_linear || (parameter.linear && given);
    const bool side = effect.name == "encoder_scale";  // a side that is not named is right
    check::that(parameter.linear || given || side, "effects." + effect.name, "the parameter " + parameter.name);
  }
  check::that((!any_linear || some_linear) && !effect.parameters.empty(), "effects." + effect.name,
              "at least one parameter");
}

}  // namespace

const std::vector<EffectLaw>& effect_laws() {
  static const std::vector<EffectLaw> laws = make_laws();
  return laws;
}

const EffectLaw& effect_law(const std::string& name) {
  const auto& laws = effect_laws();
  const auto found = std::ranges::find(laws, name, &EffectLaw::name);
  std::string known;
  for (const EffectLaw& law : laws) {
    known += (known.empty() ? "" : ", ") + law.name;
  }
  check::that(found != laws.end(), "effects: '" + name + "'", "one of " + known);
  return *found;
}

std::vector<std::string> effect_names(const std::string& model) {
  std::vector<std::string> names;
  for (const EffectLaw& law : effect_laws()) {
    if (!law.parameters_of(model).empty()) {
      names.push_back(law.name);
    }
  }
  return names;
}

void validate_effects(const Robot& robot) {
  for (std::size_t k = 0; k < robot.effects.size(); ++k) {
    const RobotEffect& effect = robot.effects[k];
    validate_effect(effect, robot);
    for (std::size_t i = 0; i < k; ++i) {
      check::that(robot.effects[i].name != effect.name, "effects." + effect.name, "each effect once");
    }
    const EffectMechanism mechanism = effect_law(effect.name).mechanism;
    check::that(mechanism == EffectMechanism::geometry || effort_per_torque(robot).has_value(),
                "effects." + effect.name, "effort as torque, or the motor's constants, to make effort of it");
  }
  check::that(!has_effect(robot, "coulomb") || !has_effect(robot, "coulomb_asymmetric"), "effects",
              "coulomb or coulomb_asymmetric, not both: they say the same of equal wheels");
}

bool has_effect(const Robot& robot, const std::string& name) {
  return std::ranges::find(robot.effects, name, &RobotEffect::name) != robot.effects.end();
}

double effect_value(const Robot& robot, const std::string& effect, const std::string& parameter) {
  const auto found = std::ranges::find(robot.effects, effect, &RobotEffect::name);
  return found != robot.effects.end() && found->parameters.contains(parameter) ? found->value(parameter) : 0.0;
}

}  // namespace wheelwright

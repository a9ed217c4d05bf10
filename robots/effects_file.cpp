// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/effects_file.hpp>

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/files/suggest.hpp>
#include <wheelwright/model/effect_law.hpp>

namespace wheelwright {
namespace {

std::string limits_of(const EffectParameterLaw& law) {
  if (law.positive) {
    return std::isfinite(law.upper) ? fmt::format("a number > 0 and at most {}", law.upper) : "a number > 0";
  }
  if (std::isfinite(law.lower) && std::isfinite(law.upper)) {
    return fmt::format("a number from {} to {}", law.lower, law.upper);
  }
  return law.lower == 0.0 ? "a number >= 0" : "a number";
}

double number(const EffectParameterLaw& law, const YamlPlace& place, const std::string& expected) {
  return place.number(expected, [&](double value) {
    return value >= law.lower && value <= law.upper && (!law.positive || value > 0.0);
  });
}

Interval value_of(const EffectParameterLaw& law, const std::string& effect, const YamlPlace& place) {
  const std::string one = limits_of(law) + (law.unit == "1" ? "" : " (" + law.unit + ")");
  if (place.is_scalar()) {
    const bool offset = effect == "sensor_time_offset";
    const double value =
        number(law, place,
               offset ? one + ": speeds that are logged early cannot be had back, log the efforts later instead" : one);
    if (law.linear && value == 0.0) {
      place.fail("a value other than 0, or an interval [lo, hi]");
    }
    return {value, value};
  }
  if (!law.linear) {
    place.fail(one + ", a single value");
  }
  const std::string both = one + ", or two of them [lo, hi] with lo < hi";
  const auto ends = place.elements(both);
  if (ends.size() != 2) {
    place.fail(both);
  }
  const Interval interval{number(law, ends[0], both), number(law, ends[1], both)};
  if (interval.lower >= interval.upper) {
    ends[1].fail(both);
  }
  return interval;
}

std::vector<std::string> keys_of(const std::vector<EffectParameterLaw>& parameters) {
  std::vector<std::string> keys = {"effect"};
  for (const EffectParameterLaw& parameter : parameters) {
    keys.push_back(parameter.name);
  }
  return keys;
}

// Keys of all effects together: with them the name of the effect is found before its own keys are checked.
std::vector<std::string> all_keys(const std::string& model) {
  std::vector<std::string> keys = {"effect"};
  for (const EffectLaw& law : effect_laws()) {
    for (const EffectParameterLaw& parameter : law.parameters_of(model)) {
      if (std::ranges::find(keys, parameter.name) == keys.end()) {
        keys.push_back(parameter.name);
      }
    }
  }
  return keys;
}

RobotEffect read_effect(const YamlPlace& place, const Robot& robot) {
  RobotEffect effect;
  const std::vector<std::string> names = effect_names(robot.model);
  if (place.is_scalar()) {
    place.fail("{effect: NAME, parameter: value, ...}");
  }
  for (const auto& [key, value] : place.members(all_keys(robot.model))) {
    if (key == "effect") {
      effect.name = names[value.choice(names)];
    }
  }
  if (effect.name.empty()) {
    place.fail("the key effect, one of " + listed(names));
  }
  const std::vector<EffectParameterLaw>& known = effect_law(effect.name).parameters_of(robot.model);
  for (const auto& [key, value] : place.members(keys_of(known))) {
    if (key != "effect") {
      const auto law = std::ranges::find(known, key, &EffectParameterLaw::name);
      effect.parameters[key] = value_of(*law, effect.name, value);
    }
  }
  return effect;
}

}  // namespace

void read_effects(const YamlPlace& place, Robot& robot) {
  for (const YamlPlace& element : place.elements("a list of {effect: NAME, parameter: value, ...}")) {
    robot.effects.push_back(read_effect(element, robot));
    Robot alone = robot;  // what else can be wrong is said by the model's own rules
    alone.effort = EffortKind::torque;
    try {
      validate_effects(alone);
    } catch (const InvalidArgument& error) {
      element.say(error.what());
    }
  }
}

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
#include "formats/robots/robot_keys.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/files/words.hpp"
#include "model/effect_law.hpp"

namespace wheelwright::robots {

using model::EffectParameterLaw;

namespace {

// The smallest of the limits that there are.
struct Limit {
  double value;
  std::string origin;
};

void set_limit(RobotWithOrigins& out, const std::string& key, std::vector<Limit> all) {
  std::erase_if(all, [&](const Limit& limit) {
    const bool none = !(limit.value > 0.0) || !std::isfinite(limit.value);
    if (none) {
      out.remarks.push_back(fmt::format("limits.{}: not taken: {}: {}", key, limit.value, limit.origin));
    }
    return none;
  });
  if (all.empty()) {
    return;
  }
  std::stable_sort(all.begin(), all.end(), [](const Limit& a, const Limit& b) { return a.value < b.value; });
  out.robot.limits[key] = all.front().value;
  std::string origin = all.front().origin;
  for (std::size_t k = 1; k < all.size(); ++k) {
    origin += all[k].value == all.front().value ? " and " + all[k].origin
                                                : fmt::format("; less than {:.6g}: {}", all[k].value, all[k].origin);
  }
  out.origins["limits." + key] = origin;
}

}  // namespace

void add_limits(RobotWithOrigins& out, const WheelJoints* wheels, const std::vector<const DriveFacts*>& drives) {
  const double r = out.robot.wheel_radius, half = 0.5 * out.robot.track_width;
  std::vector<Limit> effort, speed, acceleration;
  if (wheels) {
    for (const TreeJoint* joint : {&wheels->right, &wheels->left}) {
      if (joint->effort) {
        effort.push_back({joint->effort->value, joint->effort->place.text()});
      }
      if (joint->velocity) {
        speed.push_back({joint->velocity->value, joint->velocity->place.text()});
      }
    }
  }
  for (const DriveFacts* facts : drives) {
    if (facts == nullptr) {
      continue;
    }
    const auto add = [](std::vector<Limit>& to, const std::optional<files::OriginNumber>& number, double factor,
                        const std::string& how) {
      if (number) {
        to.push_back({factor * number->value, number->place.text() + how});
      }
    };
    add(speed, facts->speed, 1.0 / r, " / r");
    add(speed, facts->yaw_rate, half / r, " D/(2r)");
    add(acceleration, facts->acceleration, 1.0 / r, " / r");
    add(acceleration, facts->yaw_acceleration, half / r, " D/(2r)");
    add(effort, facts->wheel_effort, 1.0, "");
  }
  if (out.robot.effort == model::EffortKind::torque) {
    set_limit(out, "effort", std::move(effort));
  } else if (!effort.empty()) {
    out.remarks.push_back("limits.effort: not taken, because it is a torque and efforts are not: " +
                          effort.front().origin);
  }
  set_limit(out, "speed", std::move(speed));
  set_limit(out, "acceleration", std::move(acceleration));
}

void add_effort(RobotWithOrigins& out, const RobotTree* tree, const WheelJoints* wheels) {
  Robot& robot = out.robot;
  std::vector<const JointInterfaces*> of_wheels;
  for (std::size_t k = 0; tree != nullptr && k < tree->interfaces.size(); ++k) {
    const JointInterfaces& each = tree->interfaces[k];
    if (each.joint == wheels->right.name || each.joint == wheels->left.name) {
      of_wheels.push_back(&each);
    }
  }
  const auto with = [&](std::vector<std::string> JointInterfaces::*list, const std::string& word) {
    const auto found = std::find_if(of_wheels.begin(), of_wheels.end(), [&](const JointInterfaces* each) {
      return std::find((each->*list).begin(), (each->*list).end(), word) != (each->*list).end();
    });
    return found == of_wheels.end() ? nullptr : *found;
  };
  out.origins["effort.kind"] =
      "default, because no interface of the wheels tells; current or voltage where the log has them";
  out.origins["effort.hold"] =
      "default, because no file tells whether the log's efforts are measured (first_order) or commands";
  if (!of_wheels.empty()) {
    out.origins["effort.kind"] = of_wheels.front()->place.text() +
                                 ": default, because the wheels have no effort interface: the log needs torque, "
                                 "current or voltage from elsewhere";
  }
  const std::vector<std::pair<std::string, model::EffortKind>> words = {{"effort", model::EffortKind::torque},
                                                                        {"current", model::EffortKind::current},
                                                                        {"voltage", model::EffortKind::voltage}};
  bool found = false;
  for (const auto& [word, kind] : words) {
    const JointInterfaces* state = with(&JointInterfaces::states, word);
    const JointInterfaces* command = with(&JointInterfaces::commands, word);
    if (found || (state == nullptr && command == nullptr)) {
      continue;
    }
    found = true;
    robot.effort = kind;
    robot.hold = state != nullptr ? Hold::first_order : Hold::zero_order;
    const std::string where = (state != nullptr ? state : command)->place.text();
    out.origins["effort.kind"] =
        fmt::format("{}: {} interface {}", where, state != nullptr ? "state" : "command", word);
    out.origins["effort.hold"] =
        where + (state != nullptr ? ": it is measured" : ": it is a command, held till the next");
  }
  out.origins["effort.changes"] = "default, because no file tells";
  out.origins["effort.delay"] = "default, because no file tells";
  out.origins["effort.unsigned"] = "default, because no file tells";
  for (const JointInterfaces* each : of_wheels) {
    if (each->reduction && !robot.motor) {
      robot.motor = model::Motor{};
      robot.motor->gear_ratio = each->reduction->value;
      out.origins["motor.gear_ratio"] = each->reduction->place.text();
    }
  }
}

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

double number(const EffectParameterLaw& law, const files::YamlPlace& place, const std::string& expected) {
  return place.number(expected, [&](double value) {
    return value >= law.lower && value <= law.upper && (!law.positive || value > 0.0);
  });
}

Interval value_of(const EffectParameterLaw& law, const std::string& effect, const files::YamlPlace& place) {
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
std::vector<std::string> all_keys(const Robot& robot) {
  std::vector<std::string> keys = {"effect"};
  for (const model::EffectLaw& law : model::effect_laws()) {
    for (const EffectParameterLaw& parameter : law.parameters_of(robot)) {
      if (std::ranges::find(keys, parameter.name) == keys.end()) {
        keys.push_back(parameter.name);
      }
    }
  }
  return keys;
}

model::RobotEffect read_effect(const files::YamlPlace& place, const Robot& robot) {
  model::RobotEffect effect;
  const std::vector<std::string> names = model::effect_names(robot);
  if (place.is_scalar()) {
    place.fail("{effect: NAME, parameter: value, ...}");
  }
  for (const auto& [key, value] : place.members(all_keys(robot))) {
    if (key == "effect") {
      effect.name = names[value.choice(names)];
    }
  }
  if (effect.name.empty()) {
    place.fail("the key effect, one of " + core::listed(names));
  }
  const std::vector<EffectParameterLaw>& known = model::effect_law(effect.name).parameters_of(robot);
  for (const auto& [key, value] : place.members(keys_of(known))) {
    if (key != "effect") {
      const auto law = std::ranges::find(known, key, &EffectParameterLaw::name);
      effect.parameters[key] = value_of(*law, effect.name, value);
    }
  }
  return effect;
}

}  // namespace

void read_effects(const files::YamlPlace& place, Robot& robot) {
  for (const files::YamlPlace& element : place.elements("a list of {effect: NAME, parameter: value, ...}")) {
    robot.effects.push_back(read_effect(element, robot));
    Robot alone = robot;  // what else can be wrong is said by the model's own rules
    alone.effort = model::EffortKind::torque;
    try {
      model::validate_effects(alone);
    } catch (const InvalidArgument& error) {
      element.say(error.what());
    }
  }
}

}  // namespace wheelwright::robots

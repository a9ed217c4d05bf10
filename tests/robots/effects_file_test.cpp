// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/error.hpp"
#include "formats/robots/robot_file.hpp"
#include "model/effect_law.hpp"
#include "results/scenario_file.hpp"

namespace wheelwright::robots::effects_file_test {
namespace {

const std::string kHead = "wheel_radius: 0.0975\ntrack_width: 0.381\n";

std::string error_of(const std::string& text) {
  try {
    static_cast<void>(parse_robot(text, "robot.yaml"));
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
}

void expect_error(const std::string& effect, const std::string& part) {
  const std::string message = error_of(kHead + "effects:\n  - " + effect + "\n");
  EXPECT_NE(message.find("robot.yaml:4"), std::string::npos) << message;
  EXPECT_NE(message.find(part), std::string::npos) << message;
}

TEST(EffectsFile, ValuesAndIntervalsAreRead) {
  const Robot robot = parse_robot(kHead +
                                      "effects:\n  - {effect: coulomb, c: 0.31}\n"
                                      "  - {effect: stribeck, c_s: [0.1, 0.25], omega_s: 0.8}\n"
                                      "  - {effect: actuator_lag, T: 0.037}\n",
                                  "robot.yaml");
  ASSERT_EQ(robot.effects.size(), 3U);
  EXPECT_EQ(model::effect_value(robot, "coulomb", "c"), 0.31);
  EXPECT_DOUBLE_EQ(model::effect_value(robot, "stribeck", "c_s"), 0.175);
  EXPECT_EQ(robot.effects[1].parameters.at("c_s").lower, 0.1);
  EXPECT_EQ(model::effect_value(robot, "actuator_lag", "T"), 0.037);
  const model::PriorBox box = model::prior_box(robot, model::make_model(robot));
  EXPECT_DOUBLE_EQ(box.bounds[4].upper, 0.93);  // coulomb: three times the single value
  EXPECT_LE(box.bounds[5].lower, 0.1);          // rounded outward
  EXPECT_DOUBLE_EQ(box.bounds[5].lower, 0.1);
  EXPECT_TRUE(box.declared[5]);
}

// Every effect of the catalogue, written and read again, is the same to the last bit.
TEST(EffectsFile, ARobotFileReadsBackEqual) {
  for (const std::string model : {"differential_drive", "single_axis"}) {
    Robot kind;
    kind.model = model;
    for (const std::string& name : model::effect_names(kind)) {
      Robot robot = kind;
      if (model == "differential_drive") {
        robot.wheel_radius = 0.0975;
        robot.track_width = 0.381;
      }
      model::RobotEffect effect{name, {}};
      double value = 0.1 / 3.0;
      for (const model::EffectParameterLaw& law : model::effect_law(name).parameters_of(robot)) {
        effect.parameters[law.name] = law.linear ? Interval{value, 7.0 * value} : Interval{value, value};
        value *= 1.1;
      }
      robot.effects = {effect};
      EXPECT_EQ(parse_robot(robot_yaml(robot), name).effects, robot.effects) << name;
      EXPECT_EQ(robot_from_json(to_json(robot), name).effects, robot.effects) << name;
      EXPECT_NO_THROW(static_cast<void>(model::make_model(robot))) << name;
    }
  }
}

TEST(EffectsFile, ErrorsNameFileLineAndKey) {
  expect_error("{effect: stribek, c_s: 0.1, omega_s: 1}", "did you mean 'stribeck'");
  expect_error("{effect: coulomb, cc: 0.1}", "unknown key 'cc'");
  expect_error("{effect: coulomb, c: -0.1}", "effects.c");
  expect_error("{effect: coulomb, c: abc}", "a number >= 0");
  expect_error("{effect: coulomb, c: [0.3, 0.1]}", "lo < hi");
  expect_error("{effect: coulomb, c: 0}", "other than 0");
  expect_error("{effect: stribeck, c_s: 0.1}", "omega_s");
  expect_error("{effect: stribeck, c_s: 0.1, omega_s: [1, 2]}", "a single value");
  expect_error("{effect: actuator_lag, T: -1}", "a number > 0");
  expect_error("{effect: sensor_time_offset, dt: -0.02}", "logged early");
  expect_error("{c: 0.1}", "the key effect");
  expect_error("coulomb", "effect: NAME");
  const std::string twice =
      error_of(kHead + "effects:\n  - {effect: coulomb, c: 0.1}\n  - {effect: coulomb, c: 0.2}\n");
  EXPECT_NE(twice.find("each effect once"), std::string::npos) << twice;
  const std::string axis = error_of("model: single_axis\neffects: [{effect: slope, g_x: 0.1}]\n");
  EXPECT_NE(axis.find("effects"), std::string::npos) << axis;
}

TEST(EffectsFile, AScenarioAddsItsOwn) {
  const Scenario scenario = results::parse_scenario(
      "robot: {wheel_radius: 0.1, track_width: 0.4, effects: [{effect: coulomb, c: 0.1}]}\n"
      "parameters: {mass: 20, yaw_inertia: 0.9, viscous_linear: 4, viscous_yaw: 0.5}\n"
      "effects: [{effect: delay, T_d: 0.02}]\n",
      "scenario.yaml");
  ASSERT_EQ(scenario.robot.effects.size(), 2U);
  EXPECT_EQ(model::effect_value(scenario.robot, "delay", "T_d"), 0.02);
}

}  // namespace
}  // namespace wheelwright::robots::effects_file_test

// SPDX-License-Identifier: Apache-2.0
// Oracle: the simulator with the effect in it, at twice and at 0.3 times the size that was promised.
#include "gap/causes/visibility.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <ostream>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/words.hpp"
#include "gap/diagnose.hpp"
#include "tests/gap/noisy_log.hpp"

namespace wheelwright::gap::visibility_test {
namespace {

using gap_example::counted_robot;
using gap_example::healthy_scenario;
using gap_example::noisy_scenario;
using gap_example::robot_with;

// A cause of one number, and the log that has it at a size.
struct Case {
  std::string effect, parameter;
  std::function<void(Scenario&, double)> inject;
  friend std::ostream& operator<<(std::ostream& out, const Case& c) { return out << c.effect << ' ' << c.parameter; }
};

Case effect(const std::string& name, const std::string& parameter, const std::string& of_simulator = {},
            const std::map<std::string, double>& others = {}) {
  return {name, parameter, [=](Scenario& s, double size) {
            std::map<std::string, double> numbers = others;
            numbers[of_simulator.empty() ? parameter : of_simulator] = size;
            s.robot = robot_with(name, numbers);
          }};
}

Case change(const std::string& name, const std::string& parameter,
            const std::function<void(model::DriveParameters&, double)>& add) {
  return {name, parameter, [=](Scenario& s, double size) { add(s.parameters, size); }};
}

constexpr double kNothing = 1e-9;  // a simulated effect has no parameter of 0

Diagnosis diagnosis_of(const Scenario& scenario) {
  DiagnoseOptions options;
  options.shrink = false;
  Scenario before = healthy_scenario(scenario);
  before.sensors = scenario.sensors;
  Simulation log(scenario), healthy(before);
  return diagnose(log, &healthy, counted_robot(), options);
}

// Sizes that were promised on a log without a gap, and the log; another rate and another noise for every effect, from
// next to none to half of the efforts.
class VisibleSizes : public testing::TestWithParam<Case> {};

TEST_P(VisibleSizes, AreSeenAtTwiceTheSizeAndNotAtThreeTenthsOfIt) {
  const Case& c = GetParam();
  std::mt19937_64 generator(std::hash<std::string>()(c.effect + c.parameter) ^ 59U);
  constexpr std::array kRates{25.0, 50.0, 100.0};
  const double rate = kRates[std::uniform_int_distribution<std::size_t>(0, 2)(generator)];
  Scenario log = noisy_scenario(counted_robot(), static_cast<unsigned>(generator()), rate);
  log.sensors.effort = std::uniform_real_distribution<double>(0.05, 0.6)(generator);
  const Diagnosis nothing = diagnosis_of(log);
  ASSERT_EQ(nothing.verdict, GapVerdict::no_gap);
  const auto promised = std::ranges::find_if(
      nothing.visible, [&](const VisibleSize& v) { return v.effect == c.effect && v.parameter == c.parameter; });
  ASSERT_NE(promised, nothing.visible.end());
  EXPECT_GT(promised->size, 0.0);
  EXPECT_FALSE(promised->unit.empty());
  for (const double factor : {2.0, 0.3}) {
    Scenario with = log;
    c.inject(with, factor * promised->size);
    const Diagnosis found = diagnosis_of(with);
    EXPECT_EQ(found.verdict == GapVerdict::no_gap, factor < 1.0)
        << rate << " Hz, noise " << log.sensors.effort << ", " << factor << " times " << promised->size << ' '
        << promised->unit << ": " << to_string(found.verdict) << ", " << core::listed(found.notes, "; ");
    EXPECT_EQ(found.visible.empty(), found.verdict != GapVerdict::no_gap);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Drawn, VisibleSizes,
    testing::Values(effect("coulomb", "c"), effect("slope", "g_x", "", {{"g_y", kNothing}}),
                    effect("torque_bias", "b_R", "", {{"b_L", kNothing}}),
                    effect("quadratic_drag", "c", "", {{"c2", kNothing}}), effect("com_lateral", "b"),
                    effect("lateral_scrub", "mu"), effect("viscous_asymmetric", "b"),
                    effect("torque_gain_asymmetric", "g"), effect("delay", "T_d"), effect("actuator_lag", "T"),
                    effect("encoder_scale", "epsilon", "s_R"), effect("wheel_radius", "epsilon", "eps"),
                    change("payload", "mass_kg", [](model::DriveParameters& p, double kg) { p.mass += kg; }),
                    change("payload", "yaw_inertia", [](model::DriveParameters& p, double i) { p.yaw_inertia += i; })),
    [](const testing::TestParamInfo<Case>& given) { return given.param.effect + "_" + given.param.parameter; });

}  // namespace
}  // namespace wheelwright::gap::visibility_test

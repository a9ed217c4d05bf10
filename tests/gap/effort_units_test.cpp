// SPDX-License-Identifier: Apache-2.0
#include "gap/effort_units.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "gap/diagnose.hpp"
#include "tests/gap/noisy_log.hpp"

namespace wheelwright::gap::effort_units_test {
namespace {

using gap_example::counted_robot;
using gap_example::healthy_scenario;
using gap_example::noisy_scenario;
using gap_example::robot_with;
using model::EffortKind;

constexpr double kTorqueConstant = 0.05, kGear = 12.0, kResistance = 0.4, kBackEmf = 0.047;

// The logs of one robot, with efforts of any kind made of their torques by the motor's equations written down here.
struct Logs {
  LogTable log, healthy;

  explicit Logs(const Scenario& scenario) {
    Simulation one(scenario), other(healthy_scenario(scenario));
    log = read_all(one);
    healthy = read_all(other);
  }
};

LogTable with_efforts(LogTable log, EffortKind kind) {
  for (const char side : {'r', 'l'}) {
    const std::vector<double> speed = log.column(std::string("omega_") + side);
    std::vector<double>& effort = log.column(std::string("tau_") + side);
    for (std::size_t k = 0; k < effort.size(); ++k) {
      const double current = effort[k] / (kTorqueConstant * kGear);
      effort[k] = kind == EffortKind::current ? current : kResistance * current + kBackEmf * kGear * speed[k];
    }
    *std::ranges::find(log.names, std::string("tau_") + side) =
        std::string(kind == EffortKind::current ? "current_" : "voltage_") + side;
  }
  return log;
}

Robot robot_of(Robot robot, EffortKind kind, bool constants) {
  robot.effort = kind;
  if (constants) {
    robot.motor = model::Motor{kTorqueConstant, kResistance, kBackEmf, kGear};
  }
  return robot;
}

Diagnosis diagnosed(const Logs& logs, const Robot& robot, bool shrink = false) {
  const EffortKind kind = robot.effort;
  const LogTable efforts = kind == EffortKind::torque ? logs.log : with_efforts(logs.log, kind);
  const LogTable of_healthy = kind == EffortKind::torque ? logs.healthy : with_efforts(logs.healthy, kind);
  TableSource log(efforts), healthy(of_healthy);
  DiagnoseOptions options;
  options.shrink = shrink;
  return diagnose(log, &healthy, robot, options);
}

const GapEstimate& estimate(const Diagnosis& d, const std::string& effect, const std::string& name) {
  const auto cause = std::ranges::find(d.causes, effect, &GapCause::effect);
  if (cause == d.causes.end()) {
    throw InvalidArgument("no such cause: " + effect);
  }
  const auto found = std::ranges::find(cause->parameters, name, &GapEstimate::name);
  if (found == cause->parameters.end()) {
    throw InvalidArgument("no such parameter: " + name);
  }
  return *found;
}

void expect_near(const GapEstimate& a, const GapEstimate& b, double factor, double relative) {
  const double tolerance = relative * std::abs(b.estimate) * factor;
  EXPECT_NEAR(a.estimate, factor * b.estimate, tolerance) << a.name;
  EXPECT_NEAR(a.lower, factor * b.lower, tolerance) << a.name;
  EXPECT_NEAR(a.upper, factor * b.upper, tolerance) << a.name;
}

std::vector<std::string> units_of(const Diagnosis& d) {
  std::vector<std::string> units;
  for (const GapCause& cause : d.causes) {
    std::ranges::transform(cause.parameters, std::back_inserter(units), &GapEstimate::unit);
  }
  std::ranges::transform(d.parametric, std::back_inserter(units), &ParameterShift::unit);
  std::ranges::transform(d.series, std::back_inserter(units), &ResidualSeries::unit);
  for (const auto* figures : {&d.shrink.torque_rms, &d.shrink.rollout, &d.shrink.threshold_width}) {
    std::ranges::transform(*figures, std::back_inserter(units), &ShrinkFigure::unit);
  }
  std::ranges::transform(d.where, std::back_inserter(units), &GapShare::regime);
  return units;
}

Robot with_friction_on_a_slope() {
  Robot world = robot_with("coulomb", {{"c", 0.3}});
  world.effects.push_back({"slope", {{"g_x", {0.2, 0.2}}, {"g_y", {-0.3, -0.3}}}});
  return world;
}

// A current with a known constant is a torque: nothing but rounding may change.
TEST(EffortUnits, CurrentsOfKnownMotorsAreDiagnosedAsTheirTorques) {
  const Logs logs(noisy_scenario(with_friction_on_a_slope(), 2));
  const Diagnosis torque = diagnosed(logs, counted_robot());
  const Robot robot = robot_of(counted_robot(), EffortKind::current, true);
  const Diagnosis current = diagnosed(logs, robot);
  EXPECT_EQ(current.verdict, torque.verdict);
  EXPECT_NEAR(current.gap, torque.gap, 1e-6 * torque.gap);
  expect_near(estimate(current, "coulomb", "c"), estimate(torque, "coulomb", "c"), 1.0, 1e-4);
  EXPECT_EQ(estimate(current, "coulomb", "c").unit, "N·m");
  expect_near(estimate(current, "slope", "g_x"), estimate(torque, "slope", "g_x"), 1.0, 1e-4);
  ASSERT_EQ(current.parametric.size(), torque.parametric.size());
  for (std::size_t j = 0; j < torque.parametric.size(); ++j) {
    EXPECT_EQ(current.parametric[j].unit, torque.parametric[j].unit);
    EXPECT_NEAR(current.parametric[j].estimate, torque.parametric[j].estimate,
                1e-4 * std::abs(torque.parametric[j].estimate));
  }
  ASSERT_TRUE(torque.improved && current.improved);
  EXPECT_EQ(current.improved->effort, EffortKind::current);
  EXPECT_EQ(current.improved->limits, robot.limits);
  EXPECT_NEAR(current.improved->nominal.at("mass"), torque.improved->nominal.at("mass"), 1e-3);
  EXPECT_NEAR(model::effect_value(*current.improved, "coulomb", "c"),
              model::effect_value(*torque.improved, "coulomb", "c"), 1e-4);
}

// The back-EMF is the motor's, not the bearings'.
TEST(EffortUnits, VoltagesOfKnownMotorsAreDiagnosedAsTheirTorques) {
  const Logs logs(noisy_scenario(with_friction_on_a_slope(), 2));
  const Diagnosis torque = diagnosed(logs, counted_robot());
  const Diagnosis voltage = diagnosed(logs, robot_of(counted_robot(), EffortKind::voltage, true));
  EXPECT_EQ(voltage.verdict, torque.verdict);
  expect_near(estimate(voltage, "coulomb", "c"), estimate(torque, "coulomb", "c"), 1.0, 0.1);
  expect_near(estimate(voltage, "slope", "g_x"), estimate(torque, "slope", "g_x"), 1.0, 0.1);
  ASSERT_EQ(voltage.parametric.size(), torque.parametric.size());
  for (std::size_t j = 0; j < torque.parametric.size(); ++j) {
    const ParameterShift &a = voltage.parametric[j], &b = torque.parametric[j];
    EXPECT_NEAR(a.estimate, b.estimate, a.upper - a.lower + b.upper - b.lower) << a.parameter;
    EXPECT_EQ(a.nominal.has_value(), b.nominal.has_value());
    if (a.nominal) {
      EXPECT_NEAR(*a.nominal, *b.nominal, 1e-9 * std::abs(*b.nominal));
    }
  }
  ASSERT_TRUE(voltage.improved && torque.improved);
  for (const auto& [name, value] : torque.improved->nominal) {
    EXPECT_NEAR(voltage.improved->nominal.at(name), value, 0.1 * std::abs(value)) << name;
  }
}

class UnknownMotors : public ::testing::TestWithParam<EffortKind> {};

// What needs no constant is as it was, what needs one is in A or V and says so, and nothing is in kg or N·m.
TEST_P(UnknownMotors, TellNothingInUnitsThatNobodyKnows) {
  const EffortKind kind = GetParam();
  const double per_torque =
      kind == EffortKind::current ? 1.0 / (kTorqueConstant * kGear) : kResistance / (kTorqueConstant * kGear);
  const Logs logs(noisy_scenario(with_friction_on_a_slope(), 2));
  const Diagnosis torque = diagnosed(logs, counted_robot());
  const Diagnosis found = diagnosed(logs, robot_of(counted_robot(), kind, false), true);
  EXPECT_EQ(found.verdict, torque.verdict);
  const double relative = kind == EffortKind::current ? 1e-3 : 0.1;
  expect_near(estimate(found, "slope", "g_x"), estimate(torque, "slope", "g_x"), 1.0, relative);
  expect_near(estimate(found, "coulomb", "c"), estimate(torque, "coulomb", "c"), per_torque, relative);
  EXPECT_EQ(estimate(found, "coulomb", "c").unit, kind == EffortKind::current ? "A" : "V");
  for (const std::string& unit : units_of(found)) {
    EXPECT_THAT(unit, ::testing::Not(::testing::HasSubstr("N·"))) << unit;
    EXPECT_THAT(unit, ::testing::Not(::testing::HasSubstr("kg"))) << unit;
  }
  for (const ParameterShift& shift : found.parametric) {
    EXPECT_FALSE(shift.nominal) << shift.parameter;
  }
  EXPECT_THAT(found.notes, ::testing::Contains(::testing::HasSubstr("need the motor's constants")));
  EXPECT_FALSE(found.improved) << "a robot file has its friction in N·m";
}

INSTANTIATE_TEST_SUITE_P(Kinds, UnknownMotors, ::testing::Values(EffortKind::current, EffortKind::voltage),
                         [](const auto& tested) {
                           return tested.param == EffortKind::current ? "current" : "voltage";
                         });

TEST(EffortUnits, HaveANameForEveryQuantityOfTheCatalogue) {
  TorqueView view;
  view.physical = false;
  view.logged = EffortKind::current;
  for (const Effect& effect : effect_catalogue()) {
    for (const EffectParameter& parameter : effect.parameters) {
      const std::string unit = effort_unit(view, parameter.unit);
      const bool of_effort =
          parameter.unit.find('N') != std::string::npos || parameter.unit.find("kg") != std::string::npos;
      EXPECT_EQ(of_effort, unit != parameter.unit) << effect.name << " " << parameter.unit;
    }
  }
}

}  // namespace
}  // namespace wheelwright::gap::effort_units_test

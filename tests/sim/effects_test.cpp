// SPDX-License-Identifier: Apache-2.0
// A robot simulated with an effect, and read by a model that has the same effect: the truth comes back.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "identify/least_squares.hpp"
#include "model/effect_law.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/row_stream.hpp"
#include "model/sim/simulation.hpp"

namespace wheelwright::sim::effects_test {
namespace {

struct Case {
  std::string effect;
  std::vector<std::pair<std::string, double>> parameters;
  bool scale = false;  // torques alone show no more than a scale of θ_L, which is wrong without the effect
};

model::RobotEffect effect_of(const Case& c) {
  model::RobotEffect effect{c.effect, {}};
  for (const auto& [name, value] : c.parameters) {
    effect.parameters[name] = {value, value};
  }
  return effect;
}

Scenario drive(Hold hold) {
  Scenario s;
  s.robot.wheel_radius = 0.0975;
  s.robot.track_width = 0.381;
  s.robot.hold = hold;
  s.parameters = {.mass = 21.0, .yaw_inertia = 0.9, .viscous_x = 4.0, .viscous_y = 4.0, .viscous_yaw = 0.5};
  // Dry friction is what a model says only while no wheel stands: both wheels keep turning forward, and to one side.
  s.trajectory.kind = Trajectory::Kind::table;
  s.duration = 20.0;
  for (double t = 0.0; t <= s.duration; t += 0.02) {
    const double rise = std::min(1.0, t / 0.5);
    s.trajectory.table.t.push_back(t);
    s.trajectory.table.speed.emplace_back(rise * (0.6 + 0.25 * std::sin(2.1 * t) + 0.05 * std::sin(5.3 * t)),
                                          rise * (0.7 + 0.4 * std::sin(3.1 * t) + 0.1 * std::sin(4.3 * t)));
  }
  s.rate = 200.0;
  s.sensors.speeds = s.sensors.commands = false;
  return s;
}

struct Fit {
  Eigen::VectorXd estimate;
  double residual = 0.0;
};

// Least squares of the log of `driven`, read as `robot` says.
Fit fit(const Scenario& driven, const Robot& robot) {
  Simulation log(driven);
  const Model model = model::make_model(robot);
  const FilterDesign design{.order = 2, .alpha = 8.0, .beta = 8.0};
  TorqueRows rows(log, RegressorFilter(model, design, filter::find_measurement(log, robot, model, 2)));
  Fit result{least_squares(rows).estimate};
  RegressionBlock block;
  double squares = 0.0, count = 0.0;
  rows.rewind();
  while (rows.next(block)) {
    squares += (block.y - block.Y * result.estimate).squaredNorm();
    count += static_cast<double>(block.y.size());
  }
  result.residual = std::sqrt(squares / count);
  return result;
}

constexpr double kTolerance = 5e-3;  // of every entry of θ_L

class Effects : public ::testing::TestWithParam<Case> {};

TEST_P(Effects, WhatIsSimulatedIsIdentified) {
  for (const Hold hold : {Hold::first_order, Hold::zero_order}) {
    Scenario s = drive(hold);
    const Robot plain = s.robot;
    s.robot.effects = {effect_of(GetParam())};
    const Fit with = fit(s, s.robot), without = fit(s, plain);
    const Model model = model::make_model(s.robot);
    const Eigen::VectorXd truth = true_parameters(s, model);
    for (Eigen::Index j = 0; j < truth.size(); ++j) {
      EXPECT_NEAR(with.estimate[j], truth[j], kTolerance * std::abs(truth[j]))
          << model.parameters[static_cast<std::size_t>(j)].name << (hold == Hold::zero_order ? ", held" : ", linear");
    }
    if (GetParam().scale) {
      EXPECT_GT((without.estimate - truth).cwiseQuotient(truth).cwiseAbs().maxCoeff(), 10.0 * kTolerance);
    } else {
      EXPECT_LT(with.residual, 0.15 * without.residual);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Catalogue, Effects,
    ::testing::Values(Case{"coulomb", {{"c", 0.3}}}, Case{"coulomb_asymmetric", {{"c_R", 0.4}, {"c_L", 0.2}}},
                      Case{"stribeck", {{"c_s", 0.3}, {"omega_s", 1.5}}}, Case{"viscous_asymmetric", {{"b", 0.05}}},
                      Case{"quadratic_drag", {{"c", 0.8}, {"c2", 0.05}}}, Case{"com_longitudinal", {{"a", 0.08}}},
                      Case{"com_lateral", {{"b", 0.03}}}, Case{"torque_gain_asymmetric", {{"g", 0.06}}},
                      Case{"torque_bias", {{"b_R", 0.2}, {"b_L", -0.1}}}, Case{"slope", {{"g_x", 0.2}, {"g_y", -0.1}}},
                      Case{"actuator_lag", {{"T", 0.05}}}, Case{"delay", {{"T_d", 0.043}}},
                      Case{"sensor_time_offset", {{"dt", 0.021}}}, Case{"torque_deadzone", {{"b", 0.1}}},
                      Case{"saturation", {{"tau_max", 0.6}}}, Case{"caster_drag", {{"c", 0.3}, {"p", 0.2}}},
                      Case{"lateral_scrub", {{"mu", 0.06}}}, Case{"wheel_radius_asymmetric", {{"eps", 0.03}}},
                      Case{"wheel_radius", {{"eps", -0.04}}, true}, Case{"track_width", {{"eps", 0.05}}, true},
                      Case{"encoder_scale", {{"s_R", 0.02}, {"s_L", -0.01}}}),
    [](const ::testing::TestParamInfo<Case>& one) { return one.param.effect; });

}  // namespace
}  // namespace wheelwright::sim::effects_test

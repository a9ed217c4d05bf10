// SPDX-License-Identifier: Apache-2.0
// Mass, ground and wheel shape.
#include <cmath>
#include <numbers>

#include <wheelwright/reality/catalogue.hpp>

namespace wheelwright::reality {
namespace {

constexpr double gravity = 9.81;

Effect com_longitudinal(const RobotDesign& robot, Random random, double severity) {
  const double shift = random.sign() * 0.25 * severity * robot.half_track;
  return {"com_longitudinal",
          {{"a", shift * robot.body.chassis_mass / robot.mass}, {"com_x_m", shift}},
          [=](Body& body) { body.centre.x() += shift; },
          {},
          {},
          {},
          0.0};
}

Effect com_lateral(const RobotDesign& robot, Random random, double severity) {
  const double shift = random.sign() * 0.15 * severity * robot.half_track;
  return {"com_lateral",
          {{"b", shift * robot.body.chassis_mass / robot.mass}, {"com_y_m", shift}},
          [=](Body& body) { body.centre.y() += shift; },
          {},
          {},
          {},
          0.0};
}

Effect slope(const RobotDesign& robot, Random random, double severity) {
  const double angle = 0.25 * severity * robot.typical_torque() / (0.5 * robot.radius * robot.mass * gravity);
  const double uphill = random.uniform(-std::numbers::pi, std::numbers::pi);
  const double weight = robot.body.chassis_mass + 2.0 * robot.body.wheel_mass;
  const double pull = gravity * std::sin(angle);
  return {"slope",
          {{"g_x", pull * std::cos(uphill) * weight / robot.mass},
           {"g_y", pull * std::sin(uphill) * weight / robot.mass},
           {"angle_rad", angle},
           {"uphill_heading_rad", uphill}},
          [=](Body& body) {
            body.gravity = {-pull * std::cos(uphill), -pull * std::sin(uphill), -gravity * std::cos(angle)};
          },
          {},
          {},
          {},
          0.0};
}

Effect wheel_out_of_round(const RobotDesign& robot, Random random, double severity) {
  // The load on a wheel whose axle is off its centre pulls it to its low side.
  const double large = 0.4 * severity * robot.typical_torque();
  const std::size_t side = random.below(2);
  const double other = random.uniform(0.0, 1.0) < 0.5 ? 0.0 : random.uniform(0.0, 0.6) * large;
  Pair size{other, other};
  size[side] = large;
  const Pair phase{random.uniform(0.0, 2.0 * std::numbers::pi), random.uniform(0.0, 2.0 * std::numbers::pi)};
  return {"wheel_out_of_round",
          {{"A_R", size[right] * std::cos(phase[right])},
           {"B_R", size[right] * std::sin(phase[right])},
           {"A_L", size[left] * std::cos(phase[left])},
           {"B_L", size[left] * std::sin(phase[left])}},
          {},
          {},
          [=](const State& state, Push& push) {
            for (std::size_t i = 0; i < 2; ++i) {
              push.wheel[i] -= size[i] * std::cos(state.angle[i] - phase[i]);
            }
          },
          {},
          0.0};
}

}  // namespace

std::vector<Entry> body_effects() {
  using enum Class;
  return {{"com_longitudinal", structural, com_longitudinal, 2.6},
          {"com_lateral", structural, com_lateral, 3.0},
          {"slope", structural, slope},
          {"wheel_out_of_round", structural, wheel_out_of_round}};
}

}  // namespace wheelwright::reality

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Two robots of different size, with noise that is declared, and drives of a plan.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "commission/design/stages.hpp"
#include "model/robot.hpp"
#include "model/sim/simulation.hpp"

namespace wheelwright::testing_support {

/// The size of a Pioneer 3-DX: 19 kg, 0.78 m/s.
inline Robot small_robot() {
  Robot r;
  r.name = "small";
  r.wheel_radius = 0.0975;
  r.track_width = 0.381;
  r.hold = Hold::zero_order;
  r.parameters = std::vector<std::string>{"mass", "yaw_inertia", "viscous_linear", "viscous_yaw"};
  r.nominal = {{"mass", 19.0}, {"yaw_inertia", 1.0}, {"viscous_linear", 3.0}, {"viscous_yaw", 0.4}};
  r.noise.wheel_speed.value = 0.02;
  r.noise.effort.value = 0.02;
  r.encoder_counts_per_turn = 4096.0;
  r.filter.beta = 10.0;
  r.limits = {{"speed", 8.0}, {"acceleration", 20.0}, {"effort", 6.0}};
  return r;
}

/// A cart of 120 kg, 1.5 m/s, slower and with noisier torques.
inline Robot large_robot() {
  Robot r = small_robot();
  r.name = "large";
  r.wheel_radius = 0.15;
  r.track_width = 0.6;
  r.nominal = {{"mass", 120.0}, {"yaw_inertia", 9.0}, {"viscous_linear", 30.0}, {"viscous_yaw", 5.0}};
  r.noise.effort.value = 0.2;
  r.encoder_counts_per_turn = 2048.0;
  r.filter.beta = 6.0;
  r.limits = {{"speed", 10.0}, {"acceleration", 8.0}, {"effort", 25.0}};
  return r;
}

/// `robot` drives `plan`, with the sensors that it declares; the truth is left to the caller.
inline Scenario drive_of(const design::Plan& plan, const Robot& robot, std::uint64_t seed) {
  Scenario s;
  s.robot = robot;
  s.trajectory.kind = sim::Trajectory::Kind::table;
  for (Eigen::Index k = 0; k < plan.samples(); ++k) {
    s.trajectory.table.t.push_back(plan.t(k));
    s.trajectory.table.speed.push_back(plan.speed.col(k));
  }
  s.duration = plan.t(plan.samples() - 1);
  s.sensors.encoder_counts_per_turn = robot.encoder_counts_per_turn;
  s.sensors.effort = *robot.noise.effort.value;
  s.sensors.speeds = s.sensors.pose = s.sensors.commands = false;
  s.seed = seed;
  return s;
}

}  // namespace wheelwright::testing_support

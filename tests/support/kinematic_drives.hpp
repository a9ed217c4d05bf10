// SPDX-License-Identifier: Apache-2.0
/// \file
/// Simulated drives with a pose, for tests of the kinematic residual.
#pragma once

#include <cstdint>

#include "tests/support/drives.hpp"

namespace wheelwright::testing_support {

/// The scenario with a pose whose noise is declared: 2 mm, 3 mrad.
inline Scenario with_pose(Scenario s) {
  s.sensors.pose = true;
  s.sensors.position = 0.002;
  s.sensors.heading = 0.003;
  s.robot.noise.position.value = 0.002;
  s.robot.noise.heading.value = 0.003;
  return s;
}

/// noisy_drive() with a pose whose noise the robot declares: 2 mm and 3 mrad.
inline Scenario posed_drive(std::uint64_t seed, double duration = 20.0) {
  return with_pose(noisy_drive(seed, duration));
}

/// The same robot on a straight line.
inline Scenario straight_drive(std::uint64_t seed, double duration) {
  Scenario s = posed_drive(seed, duration);
  s.trajectory = {.kind = sim::Trajectory::Kind::straight, .speed = 0.6, .yaw_rate = 0.0, .period = 8.0};
  return s;
}

/// [r_R, r_L, c_R, c_L] of a robot without faults.
inline Eigen::VectorXd true_kinematics(const Robot& robot) {
  const double r = robot.wheel_radius, c = r / robot.track_width;
  return Eigen::Vector4d(r, r, c, c);
}

}  // namespace wheelwright::testing_support

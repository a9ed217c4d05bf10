// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/sim/controller.hpp>

#include <algorithm>
#include <cmath>

namespace wheelwright {

TrackingController::TrackingController(const DifferentialDrive& drive, const DriveParameters& nominal,
                                       const ControllerGains& gains, std::optional<double> torque_limit)
    : drive_(drive), nominal_(nominal), gains_(gains), torque_limit_(torque_limit) {}

TrackingController::Command TrackingController::step(const Eigen::Vector3d& reference_pose,
                                                     const ReferenceSpeed& reference, const Eigen::Vector3d& pose,
                                                     const Eigen::Vector2d& v, double h) {
  const double c = std::cos(pose[2]), s = std::sin(pose[2]);
  const Eigen::Vector3d world = reference_pose - pose;
  const double x = c * world[0] + s * world[1], y = -s * world[0] + c * world[1], turn = world[2];
  const double sinc = std::abs(turn) < 1e-4 ? 1.0 - turn * turn / 6.0 : std::sin(turn) / turn;

  Command command;
  command.speed = {reference.speed[0] * std::cos(turn) + gains_.along * x,
                   reference.speed[1] + gains_.across * reference.speed[0] * sinc * y + gains_.heading * turn};

  const Eigen::Vector2d error = command.speed - v;
  const Eigen::Vector2d acceleration = reference.acceleration + gains_.speed * error + gains_.integral * integral_;
  const double along_x = c * c;
  const double viscous = nominal_.viscous_x * along_x + nominal_.viscous_y * (1.0 - along_x);
  const double force = nominal_.mass * acceleration[0] + viscous * command.speed[0];
  const double moment = nominal_.yaw_inertia * acceleration[1] + nominal_.viscous_yaw * command.speed[1];
  const double half_sum = 0.5 * drive_.wheel_radius * force;
  const double half_difference = 0.5 * drive_.wheel_radius * moment / drive_.lever_arm();
  command.torque = {half_sum + half_difference, half_sum - half_difference};

  const bool saturated = torque_limit_ && command.torque.cwiseAbs().maxCoeff() > *torque_limit_;
  if (saturated) {
    command.torque = command.torque.cwiseMin(*torque_limit_).cwiseMax(-*torque_limit_);
  } else {
    integral_ += h * error;  // held while saturated, so that it does not wind up
  }
  return command;
}

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Changes of a rigid-body simulator of a differential drive that make it a robot with other properties: physical
/// quantities, whatever the simulator calls them.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace wheelwright::model {

/// Something that a simulator's file has no number for.
struct NotExpressed {
  std::string cause;    ///< name of the effect
  std::string why;      ///< why not
  std::string instead;  ///< what to do in its place, with the numbers
};

/// Changes beside what a simulator has already. Pairs: right wheel, left wheel.
struct SimulatorChange {
  double mass = 0.0;          ///< more of the body, kg
  double moment_ahead = 0.0;  ///< change of the body's first moment about the middle of the axle, kg·m, ahead
  double moment_left = 0.0;   ///< likewise to the left
  double yaw_inertia = 0.0;  ///< change of the robot's moment about the vertical through the middle of the axle, kg·m²
  Eigen::Vector2d dry_friction = Eigen::Vector2d::Zero();   ///< more at the wheels' joints, N·m
  Eigen::Vector2d damping = Eigen::Vector2d::Zero();        ///< likewise viscous, N·m·s/rad
  Eigen::Vector2d armature = Eigen::Vector2d::Zero();       ///< more inertia of rotors and gears at the wheels, kg·m²
  Eigen::Vector2d radius_factor = Eigen::Vector2d::Ones();  ///< of the wheels
  double track_factor = 1.0;                                ///< of the distance of the wheels
  Eigen::Vector2d gain = Eigen::Vector2d::Ones();  ///< torque at the wheel per commanded one, times what it was
  std::optional<double> effort_limit;              ///< largest torque at a wheel, N·m

  /// The effects that ask for a change: the member's name -> names, apart by commas.
  std::map<std::string, std::string> because;
  std::vector<NotExpressed> not_expressed;  ///< causes that are no such change

  /// True if nothing changes.
  [[nodiscard]] bool empty() const { return because.empty(); }
};

}  // namespace wheelwright::model

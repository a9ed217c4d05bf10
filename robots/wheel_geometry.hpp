// SPDX-License-Identifier: Apache-2.0
/// \file
/// Radius, track width and axle of a differential drive, from a robot description.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/robots/robot_tree.hpp>
#include <wheelwright/robots/wheel_joints.hpp>

namespace wheelwright {

/// The axle of a differential drive, in the robot's frame.
struct Axle {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< of the wheels' centres, m
  Eigen::Vector3d left = Eigen::Vector3d::UnitY();   ///< unit, from the right wheel to the left one
  Eigen::Vector3d ahead = Eigen::Vector3d::UnitX();  ///< unit, left × up
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();     ///< unit
  double track_width = 0.0;                          ///< D, m
  std::string origin;                                ///< of the track width
  std::vector<std::string> remarks;
};

/// The radius of the wheels; nothing where no round shape gives it.
struct WheelRadius {
  std::optional<double> value;  ///< m
  std::string origin;           ///< where it came from; without a value, why there is none and what to give
};

/// Names of the links that turn with the child of `joint`: the child, and what is fixed to it.
[[nodiscard]] std::vector<std::string> turning_links(const RobotTree& tree, const TreeJoint& joint);

/// The radius of the larger cylinder (axis along the joint's within 2°) or sphere of a wheel, taken from its collision shapes,
/// from the visual ones where there is no collision. Throws InputError where a wheel's shape stands off its axis by more than
/// a hundredth of the radius, or the two wheels differ by more than 10⁻⁵ of the radius. A wheel whose shape is a mesh, a box or
/// missing has no radius, which is told by `origin`.
[[nodiscard]] WheelRadius wheel_radius(const RobotTree& tree, const WheelJoints& wheels);

/// The axle through the centres of the wheels: D = uᵀ(c_L − c_R) with the wheels' common axis u. The centre of a wheel is that
/// of its round collision shape (visual without one), projected on the joint's axis; without one the joint's origin. Throws
/// InputError unless the axes are parallel to each other and to the line between the centres within 2°, and level within 2°.
[[nodiscard]] Axle axle(const RobotTree& tree, const WheelJoints& wheels);

}  // namespace wheelwright

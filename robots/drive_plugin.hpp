// SPDX-License-Identifier: Apache-2.0
/// \file
/// The differential-drive plugins of Gazebo, in URDF and SDF.
#pragma once

#include <optional>

#include <wheelwright/files/xml_place.hpp>
#include <wheelwright/robots/robot_tree.hpp>

namespace wheelwright {

/// What a <plugin> says of a differential drive; nothing where it is another plugin. Keys are read as Gazebo's own plugins
/// (left_joint, right_joint, wheel_separation, wheel_radius, max_linear_velocity, ...), gazebo_ros_diff_drive (wheel_diameter,
/// max_wheel_torque) and its predecessor (leftJoint, wheelSeparation, ...) write them. Throws InputError, naming file, line
/// and element, for values that are not numbers > 0, and for plugins that drive more than two wheels.
[[nodiscard]] std::optional<DriveFacts> read_drive_plugin(const XmlPlace& plugin);

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Parameters of drive controllers: ROS's diff_drive_controller and the plugins of Gazebo.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "formats/files/place.hpp"
#include "formats/robots/robot_description.hpp"

namespace wheelwright::robots {

/// Reads the parameters of a diff_drive_controller from a ros2_control parameter file (YAML; nested or dotted keys;
/// that of ROS 1 too): wheel_separation and wheel_radius with their multipliers, names of the wheels' joints, limits of
/// speed and acceleration, update and publish rates. A limit counts where its has_..._limits is true, or is not there
/// (as newer controllers have it); one that is NaN is none. `controller` names one of several; empty: the only one.
/// Throws InputError, naming file, line and key, for values that are no numbers or <= 0, left and right radius
/// multipliers that differ, more than one wheel a side (there is no model of that yet), substitutions that a launch
/// file should have expanded, and where there is no such controller or several without a name.
[[nodiscard]] DriveFacts read_ros2_control(const std::filesystem::path& path, const std::string& controller = {});

/// The same from text; `file` is for messages.
[[nodiscard]] DriveFacts parse_ros2_control(std::string_view text, const std::string& file,
                                            const std::string& controller = {});

/// Data of a differential drive from a <plugin>; nothing where it is another plugin. Keys are read as Gazebo's own
/// plugins (left_joint, right_joint, wheel_separation, wheel_radius, max_linear_velocity, ...), gazebo_ros_diff_drive
/// (wheel_diameter, max_wheel_torque) and its predecessor (leftJoint, wheelSeparation, ...) write them. Throws
/// InputError, naming file, line and element, for values that are not numbers > 0, and for plugins that drive more than
/// two wheels.
[[nodiscard]] std::optional<DriveFacts> read_drive_plugin(const files::XmlPlace& plugin);

}  // namespace wheelwright::robots

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Robot descriptions in URDF.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <wheelwright/robots/robot_tree.hpp>

namespace wheelwright {

/// Reads a URDF file: links with inertials and shapes, joints with dynamics and limits, <transmission> and <ros2_control>
/// interfaces, differential-drive plugins inside <gazebo>. Origins are composed from the root link through the joints at
/// their zero positions: T_child = T_parent · T_origin, with the fixed-axis angles R = Rz(yaw) Ry(pitch) Rx(roll). An origin
/// that is left out is the identity, and an axis (1, 0, 0), as URDF has it; nothing else has a default. Throws InputError,
/// naming file, line and element, for what is not there or makes no sense, and for xacro, which has to be expanded first.
[[nodiscard]] RobotTree read_urdf(const std::filesystem::path& path);

/// The same from text; `file` is for messages.
[[nodiscard]] RobotTree parse_urdf(std::string_view text, const std::string& file);

}  // namespace wheelwright

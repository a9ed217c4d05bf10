// SPDX-License-Identifier: Apache-2.0
/// \file
/// Commands of speed and yaw rate as a recording that `ros2 bag play` drives a robot with.
#pragma once

#include <filesystem>

#include "core/log.hpp"

namespace wheelwright::logs {

/// Writes `commands`, with the columns linear_x (m/s) and angular_z (rad/s), at `path` (.mcap, .db3, or a directory):
/// geometry_msgs/TwistStamped on /cmd_vel and geometry_msgs/Twist on /cmd_vel_unstamped, a message each for every row
/// at its time. Stamps in headers are zero, which controllers read as *now*: a stamp of the recording would be long
/// past when it is played. Throws InvalidArgument without these columns; InputError where the file cannot be written.
void write_velocity_commands(const std::filesystem::path& path, const LogTable& commands);

}  // namespace wheelwright::logs

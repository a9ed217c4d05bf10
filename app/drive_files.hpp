// SPDX-License-Identifier: Apache-2.0
/// \file
/// A planned drive as files: commands of the wheels, and of the robot's speed and yaw rate for its controller.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "model/robot.hpp"

namespace wheelwright::app {

/// Names of the files that write_drive() may write for `stem`.
[[nodiscard]] std::vector<std::string> drive_files(const std::string& stem);

/// Writes STEM.csv (design::command_table()) into `out` and, for a robot on two wheels, STEM_cmd_vel.csv and
/// STEM_cmd_vel.mcap (logs::write_velocity_commands()).
void write_drive(const std::filesystem::path& out, const std::string& stem, const LogTable& commands,
                 const Robot& robot);

}  // namespace wheelwright::app

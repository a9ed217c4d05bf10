// SPDX-License-Identifier: Apache-2.0
/// \file
/// Logs of a fleet, opened as its list names them.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "formats/logs/log_file.hpp"
#include "formats/robots/fleet_list.hpp"
#include "formats/robots/robot_file.hpp"
#include "model/robot.hpp"
#include "study/robot_logs.hpp"

namespace wheelwright::results {

/// How the logs of a fleet are read.
struct FleetReading {
  std::optional<Robot> robot;        ///< of every robot that has no file of its own
  robots::ColumnMap columns;         ///< of its robot file
  logs::LogOptions reader;           ///< its `map` goes before that of a robot file
  std::vector<std::string> despite;  ///< as open_sound_log()
};

/// The logs of one robot for study::examine_robot(); each is opened when its turn comes, by open_sound_log(). Keeps a
/// reference to `reading`.
[[nodiscard]] study::RobotLogs logs_of(const robots::FleetListRobot& robot, const FleetReading& reading);

}  // namespace wheelwright::results

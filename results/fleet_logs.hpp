// SPDX-License-Identifier: Apache-2.0
/// \file
/// Logs that are examined before anything is made of them; those of a fleet, opened as its list names them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "commission/doctor/log_health.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/robots/fleet_list.hpp"
#include "formats/robots/robot_file.hpp"
#include "model/robot.hpp"
#include "study/examine_robot.hpp"

namespace wheelwright::results {

/// Rows by which a log is judged before a command uses it.
inline constexpr std::size_t kExaminedRows = 200000;

/// What is done with a pose that only repeats the wheels.
enum class WheelPose {
  judged,  ///< kept: the command finds that out itself (commission)
  hidden,  ///< its columns are not read
};

/// A log whose units, signs and sides fit its robot.
struct SoundLog {
  std::unique_ptr<logs::RecordedLog> log;
  std::vector<std::string> remarks;  ///< what was hidden and why, and what was passed over; one sentence each
};

/// The log in `paths` with the columns that `robot` can use, after the doctor's checks of its first kExaminedRows:
/// where units, signs or sides cannot be right, InputError names the findings, and what to do. `despite` passes over
/// findings by their names. Other fatal findings (nothing excited, a dead signal, efforts late) are left to the
/// callers, which have an answer of their own to each. A log that lacks columns is not examined. Throws as open_log().
[[nodiscard]] SoundLog open_sound_log(const std::vector<std::filesystem::path>& paths, const Robot& robot,
                                      logs::LogOptions reader, const std::vector<std::string>& despite, WheelPose pose,
                                      std::size_t threads = 1);

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

// SPDX-License-Identifier: Apache-2.0
#include "results/fleet_logs.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/sound_log.hpp"

namespace wheelwright::results {

namespace {

study::FleetLog log_of(const robots::FleetListRobot& robot, const std::vector<robots::FleetListLog>& logs,
                       const FleetReading& reading) {
  study::FleetLog out;
  std::vector<std::filesystem::path> paths;
  for (const robots::FleetListLog& log : logs) {
    out.name += (out.name.empty() ? "" : ", ") + log.path.string();
    paths.push_back(log.path);
  }
  out.when = logs.empty() ? 0.0 : logs.front().when;
  out.open = [file = robot.robot_file, &reading, paths] {
    if (paths.empty()) {
      throw InputError("no log to commission with: expected one with the role commission, or none");
    }
    if (file.empty() && !reading.robot) {
      throw InputError("no robot file: expected --robot, or a robot.yaml or robot_file of its own");
    }
    const Robot declared = file.empty() ? *reading.robot : read_robot(file);
    logs::LogOptions options = reading.reader;
    options.map = file.empty() ? reading.columns : robots::read_columns(file, logs::log_column_names());
    for (const auto& [name, column] : reading.reader.map) {
      options.map[name] = column;
    }
    SoundLog opened = open_sound_log(paths, declared, std::move(options), reading.despite, WheelPose::judged);
    logs::require_columns(*opened.log, robots::needed_columns(declared));
    const logs::LogReport& report = opened.log->report();
    Robot robot_with_errors = model::with_column_errors(opened.robot, logs::interpolation_errors(report));
    const std::size_t met = report.rows_read;
    return study::OpenedLog{std::move(opened.log), std::move(robot_with_errors), met};
  };
  return out;
}

}  // namespace

study::RobotLogs logs_of(const robots::FleetListRobot& robot, const FleetReading& reading) {
  study::RobotLogs logs{.robot = robot.name,
                        .dated = robot.dated,
                        .commissioning = log_of(robot, robot.commission, reading),
                        .findings = robot.findings};
  for (const robots::FleetListLog& check : robot.checks) {
    logs.checks.push_back(log_of(robot, {check}, reading));
  }
  return logs;
}

}  // namespace wheelwright::results

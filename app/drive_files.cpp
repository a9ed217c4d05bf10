// SPDX-License-Identifier: Apache-2.0
#include "app/drive_files.hpp"

#include "commission/design/plan.hpp"
#include "formats/logs/csv.hpp"
#include "formats/logs/velocity_commands.hpp"

namespace wheelwright::app {

std::vector<std::string> drive_files(const std::string& stem) {
  return {stem + ".csv", stem + "_cmd_vel.csv", stem + "_cmd_vel.mcap"};
}

void write_drive(const std::filesystem::path& out, const std::string& stem, const LogTable& commands,
                 const Robot& robot) {
  const std::vector<std::string> files = drive_files(stem);
  logs::write_csv(out / files[0], commands);
  if (model::on_two_wheels(robot)) {
    const LogTable velocities = design::velocity_table(commands, robot);
    logs::write_csv(out / files[1], velocities);
    logs::write_velocity_commands(out / files[2], velocities);
  }
}

}  // namespace wheelwright::app

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/robot_columns.hpp>

namespace wheelwright::robots {
namespace {

const std::string& effort_column(const Robot& robot, const model::Joint& joint) {
  return robot.effort == model::EffortKind::torque    ? joint.torque
         : robot.effort == model::EffortKind::current ? joint.current
                                                      : joint.voltage;
}

}  // namespace

std::vector<std::string> useful_columns(const Robot& robot) {
  std::vector<std::string> names = {"t", "x", "y", "theta", "gyro_z", "command_r", "command_l"};
  for (const model::Joint& joint : model::make_model(robot).joints) {
    names.insert(names.end(), {joint.angle, joint.speed, effort_column(robot, joint)});
  }
  return names;
}

std::vector<std::string> needed_columns(const Robot& robot) {
  std::vector<std::string> names;
  for (const model::Joint& joint : model::make_model(robot).joints) {
    names.insert(names.end(), {joint.speed + "|" + joint.angle, effort_column(robot, joint)});
  }
  return names;
}

}  // namespace wheelwright::robots

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/robot_columns.hpp>

namespace wheelwright {
namespace {

const std::string& effort_column(const Robot& robot, const Joint& joint) {
  return robot.effort == EffortKind::torque    ? joint.torque
         : robot.effort == EffortKind::current ? joint.current
                                               : joint.voltage;
}

}  // namespace

std::vector<std::string> useful_columns(const Robot& robot) {
  std::vector<std::string> names = {"t", "x", "y", "theta", "gyro_z", "command_r", "command_l"};
  for (const Joint& joint : make_model(robot).joints) {
    names.insert(names.end(), {joint.angle, joint.speed, effort_column(robot, joint)});
  }
  return names;
}

std::vector<std::string> needed_columns(const Robot& robot) {
  std::vector<std::string> names;
  for (const Joint& joint : make_model(robot).joints) {
    names.insert(names.end(), {joint.speed + "|" + joint.angle, effort_column(robot, joint)});
  }
  return names;
}

}  // namespace wheelwright

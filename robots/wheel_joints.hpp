// SPDX-License-Identifier: Apache-2.0
/// \file
/// Which joints of a robot description carry the driven wheels.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/robots/robot_tree.hpp>

namespace wheelwright {

/// The joints of the two driven wheels, and why these.
struct WheelJoints {
  TreeJoint right;
  TreeJoint left;
  std::string reason;  ///< "named by --left and --right", "the only continuous joints ...", "robot.urdf:80: ..."
};

/// Names of the wheels' joints from outside the description, and who gave them ("--left and --right", "robot.sdf:9: ...");
/// empty where nobody did.
struct NamedWheels {
  std::vector<std::string> left, right;
  std::string by;
};

/// The driven wheels of `tree`: those named; else the continuous joints with a level axis across the robot (within 2° of y)
/// whose name, or whose link's name, does not say caster; where these are more than two, those that say wheel. Left is the
/// one with the larger y. Throws InputError where this leaves other than one wheel on each side, listing the candidates and
/// the options to give; where names and sides contradict each other; for a name that is no such joint (with the nearest that
/// is); and for robots with two or more wheels a side, of which there is no model yet (skid steer).
[[nodiscard]] WheelJoints driven_wheels(const RobotTree& tree, const NamedWheels& named);

}  // namespace wheelwright

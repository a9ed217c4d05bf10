// SPDX-License-Identifier: Apache-2.0
/// \file
/// Parts of robot_from: what efforts are, and limits.
#pragma once

#include <vector>

#include <wheelwright/robots/robot_origin.hpp>
#include <wheelwright/robots/wheel_joints.hpp>

namespace wheelwright {

/// Sets kind and hold of the efforts, and the gear ratio, from the interfaces of the wheels' joints; the defaults of the robot
/// file where there are none. `tree` and `wheels` may be nullptr (no description).
void add_effort(RobotWithOrigins& out, const RobotTree* tree, const WheelJoints* wheels);

/// Sets the limits: of each the least that the wheels' joints (nullptr: none) and `drives` (nullptr: none) have,
/// with ω <= min(v/r, v2 D/(2r)) for those of the body. A limit of 0 is a remark, and so is one of torque where efforts are
/// none. Needs radius, track width and kind of effort.
void add_limits(RobotWithOrigins& out, const WheelJoints* wheels, const std::vector<const DriveFacts*>& drives);

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Parsers of parts of a robot file: effort, limits, effects.
#pragma once

#include <vector>

#include <wheelwright/files/yaml_place.hpp>
#include <wheelwright/model/robot.hpp>
#include <wheelwright/robots/robot_origin.hpp>
#include <wheelwright/robots/wheel_geometry.hpp>

namespace wheelwright::robots {

/// Sets kind and hold of the efforts, and the gear ratio, from the interfaces of the wheels' joints; the defaults of
/// the robot file where there are none. `tree` and `wheels` may be nullptr (no description).
void add_effort(RobotWithOrigins& out, const RobotTree* tree, const WheelJoints* wheels);

/// Sets the limits: of each the least that the wheels' joints (nullptr: none) and `drives` (nullptr: none) have,
/// with ω <= min(v/r, v2 D/(2r)) for those of the body. A limit of 0 is a remark, and so is one of torque where efforts
/// are none. Needs radius, track width and kind of effort.
void add_limits(RobotWithOrigins& out, const WheelJoints* wheels, const std::vector<const DriveFacts*>& drives);

/// Reads [{effect: NAME, parameter: value | [lo, hi], ...}, ...] at `place` into the effects of `robot`, after those
/// that it has; names and limits are those of model/effect_law.hpp for the robot's model. An interval, lo < hi, says
/// what is known of a parameter that is bounded from a log; every other one takes a single value. Throws InputError,
/// naming file, line and key, for unknown or repeated effects and parameters (with the nearest name), wrong types and
/// impossible values.
void read_effects(const files::YamlPlace& place, Robot& robot);

}  // namespace wheelwright::robots

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The key `effects` of robot and scenario files.
#pragma once

#include <vector>

#include <wheelwright/files/yaml_place.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// Reads [{effect: NAME, parameter: value | [lo, hi], ...}, ...] at `place` into the effects of `robot`, after those that it
/// has; names and limits are those of model/effect_law.hpp for the robot's model. An interval, lo < hi, says what is known
/// of a parameter that is bounded from a log; every other one takes a single value. Throws InputError, naming file, line and
/// key, for unknown or repeated effects and parameters (with the nearest name), wrong types and impossible values.
void read_effects(const YamlPlace& place, Robot& robot);

}  // namespace wheelwright

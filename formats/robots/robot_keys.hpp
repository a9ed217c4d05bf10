// SPDX-License-Identifier: Apache-2.0
/// \file
/// Parsers of parts of a robot file: effort, limits, effects; and the words of enumerations, which model.json has too.
#pragma once

#include <cstddef>
#include <vector>

#include "core/warrant.hpp"
#include "formats/files/place.hpp"
#include "formats/files/words.hpp"
#include "formats/robots/robot_origin.hpp"
#include "formats/robots/wheel_geometry.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/noise.hpp"
#include "model/robot.hpp"

namespace wheelwright::robots {

/// Bytes of the longest model.json that is read: as many as files::read_json() takes.
inline constexpr std::size_t longest_model_file = std::size_t{1} << 26;

inline constexpr files::Words<core::Warrant, 3> kWarrantWords{
    {{core::Warrant::guaranteed, core::warrant_word(core::Warrant::guaranteed)},
     {core::Warrant::extrapolated, core::warrant_word(core::Warrant::extrapolated)},
     {core::Warrant::statistical, core::warrant_word(core::Warrant::statistical)}}};
inline constexpr files::Words<core::AssumptionVerdict, 3> kVerdictWords{
    {{core::AssumptionVerdict::holds, "holds"},
     {core::AssumptionVerdict::not_tested, "not_tested"},
     {core::AssumptionVerdict::fails, "fails"}}};
inline constexpr files::Words<core::NoiseOrigin, 2> kNoiseOriginWords{
    {{core::NoiseOrigin::declared, "declared"}, {core::NoiseOrigin::estimated, "estimated"}}};
inline constexpr files::Words<filter::NoiseMode, 2> kNoiseModeWords{
    {{filter::NoiseMode::worst_case, "worst_case"}, {filter::NoiseMode::statistical, "statistical"}}};
inline constexpr files::Words<MotionKind, 3> kMotionWords{
    {{MotionKind::angle, "angle"}, {MotionKind::mean_speed, "mean_speed"}, {MotionKind::speed, "speed"}}};
inline constexpr files::Words<Hold, 2> kHoldWords{
    {{Hold::zero_order, "zero_order"}, {Hold::first_order, "first_order"}}};

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

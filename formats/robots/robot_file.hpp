// SPDX-License-Identifier: Apache-2.0
/// \file
/// Robot files (YAML) ↔ Robot ↔ JSON, and the columns of a log that a robot's model asks for.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "formats/files/json.hpp"
#include "model/robot.hpp"

namespace wheelwright::robots {

/// Columns that a robot of this model can use, so that a defect elsewhere in a file does no harm.
[[nodiscard]] std::vector<std::string> useful_columns(const Robot& robot);

/// Columns that commissioning needs, as require_columns() takes them: each joint's effort, and its speed or angle.
[[nodiscard]] std::vector<std::string> needed_columns(const Robot& robot);

/// Reads a robot file. Its keys, all optional but those that the model needs (wheel_radius and track_width for
/// differential_drive):
///
///     name, model: differential_drive | single_axis, wheel_radius (m), track_width (m), lever_arm: half_track | track,
///     friction: isotropic | anisotropic, parameters: [physical names], effort: {kind: torque | current | voltage,
///     hold: zero_order | first_order, unsigned: bool, changes: between | at_samples, delay: s | [lo, hi]},
///     nominal: {physical name: value}, prior: {physical name: [lo, hi]},
///     noise: estimate | {wheel_speed, wheel_angle, effort, position, heading, gyro: bound | estimate},
///     filter: auto | {order: 1 | 2, alpha, beta: 1/s}, encoder_counts_per_turn, speed_source: auto |
///     encoder_difference | measured, pose_source: auto | independent, heading_offset: rad,
///     wheel_directions: unknown | checked, limits: {effort, speed, acceleration},
///     clock: stamps | {step: s, drift: share} (core/even_clock.hpp),
///     motor: {torque_constant, resistance, back_emf, gear_ratio},
///     effects: [{effect: name, parameter: value | [lo, hi], ...}] (model/effect_law.hpp),
///     columns: {name: column}, which read_columns() hands out
///
/// Physical names: mass, yaw_inertia, viscous_linear, viscous_yaw, coulomb (differential_drive; viscous_x and viscous_y
/// instead of viscous_linear where the friction is anisotropic); inertia, viscous, coulomb, offset (single_axis).
/// Throws InputError, naming file, line, key, value and what was expected, for unknown or repeated keys, wrong types
/// and impossible values.
[[nodiscard]] Robot read_robot(const std::filesystem::path& path);

/// Where the robot's logs have the columns of the log contract: name -> column of a file, or TOPIC.FIELD of a bag, as
/// LogOptions::map has them.
using ColumnMap = std::map<std::string, std::string>;

/// The key `columns` of a robot file, or of the robot in a model.json; empty where there is none, and where the file is
/// neither (its own reader says so). Throws InputError for a file that cannot be read and for a name that is none of
/// `names`.
[[nodiscard]] ColumnMap read_columns(const std::filesystem::path& path, const std::vector<std::string>& names);

/// The line of a robot file with that key; nothing where `columns` is empty.
[[nodiscard]] std::string columns_yaml(const ColumnMap& columns);

/// The same from text; `file` is for messages.
[[nodiscard]] Robot parse_robot(std::string_view text, const std::string& file);

/// The text of a robot file from which parse_robot makes the same Robot.
[[nodiscard]] std::string robot_yaml(const Robot& robot);

/// Writes a robot file from which read_robot makes the same Robot; whole or not at all.
void write_robot(const std::filesystem::path& path, const Robot& robot);

/// The robot as a JSON object with the keys of the robot file (schema: results/robot.schema.json).
[[nodiscard]] Json to_json(const Robot& robot);

/// The Robot of such an object. `where` ("model.json: /robot") is for messages; InputError as read_robot, without
/// lines.
[[nodiscard]] Robot robot_from_json(const Json& object, const std::string& where);

}  // namespace wheelwright::robots

namespace wheelwright {
using robots::read_robot;
}  // namespace wheelwright

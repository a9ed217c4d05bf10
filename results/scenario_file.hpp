// SPDX-License-Identifier: Apache-2.0
/// \file
/// Scenario files (YAML) → Scenario.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "model/sim/simulation.hpp"

namespace wheelwright::results {

/// Reads a scenario file. `robot` and `parameters` are needed, every other key has the default of the struct:
///
///     robot: FILE (relative to the scenario file) | {the keys of a robot file}
///     parameters: {mass (kg), yaw_inertia (kg·m²), viscous_linear (N·s/m; or viscous_x and viscous_y), viscous_yaw
///                  (N·m·s/rad)}                                                  the truth
///     trajectory: {kind: straight | circle | figure_eight | multi_sine | spin | stops | commissioning | table, speed
///     (m/s),
///                  yaw_rate (rad/s), period (s), file: FILE (of kind table, relative to the scenario file: a CSV with
///                  t, command_r, command_l in s and rad/s, as `wheelwright design` writes it; begins at time 0)}
///     controller: {along, across, heading, speed, integral, torque_limit (N·m)}
///     start: {pose: [x, y, θ], error: [x, y, θ]}                                 of the reference; robot minus
///     reference faults: [{kind: wheel_radius | wheel_radius_right | wheel_radius_left | slip_x | slip_y | slip_yaw |
///     matched |
///               unmatched, magnitude (m, m/s, rad/s), onset (s), shape: step | ramp | smooth, rise_time (s), end (s)}]
///     sensors: {sampling: instant | interval, noise: uniform | truncated_gaussian | two_point, wheel_speed,
///     wheel_angle,
///               effort, position, heading (bounds), encoder_counts_per_turn, log: [angles, speeds, pose, commands]}
///     effects: [{effect: name, parameter: value, ...}]      as in a robot file; beside those that the robot brings
///     duration (s; by default 60, or that of the table), rate (Hz), time_jitter (share of the period), gaps: [[from,
///     to], ...] (s), seed
///
/// Throws InputError, naming file, line, key, value and what was expected, for unknown or repeated keys, wrong types
/// and impossible values; naming the file and the field where values do not go together.
/// `read` is given the files that it names, where it is not null.
[[nodiscard]] Scenario read_scenario(const std::filesystem::path& path,
                                     std::vector<std::filesystem::path>* read = nullptr);

/// The same from text; `file` is for messages, and robot files and tables are looked for in `folder`.
[[nodiscard]] Scenario parse_scenario(std::string_view text, const std::string& file,
                                      const std::filesystem::path& folder = {},
                                      std::vector<std::filesystem::path>* read = nullptr);

}  // namespace wheelwright::results

namespace wheelwright {
using results::read_scenario;
}  // namespace wheelwright

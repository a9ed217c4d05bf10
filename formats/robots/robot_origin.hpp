// SPDX-License-Identifier: Apache-2.0
/// \file
/// Robot files from URDF and the parameters of a controller; each value with its origin.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "formats/files/json.hpp"
#include "formats/robots/robot_description.hpp"
#include "model/robot.hpp"

namespace wheelwright::robots {

/// Facts that the caller knows beside the files.
struct RobotHints {
  std::vector<std::string> left, right;  ///< joints of the driven wheels; empty: those that the files tell
  std::optional<double> wheel_radius;    ///< m, goes before the files
  std::optional<double> track_width;     ///< m, goes before the files
  std::vector<std::string> massless;     ///< links that have a shape and no mass
  std::optional<std::string> name;       ///< of the robot
};

/// A robot whose every value says where it came from.
struct RobotWithOrigins {
  Robot robot;
  std::map<std::string, std::string> origins;  ///< key of the robot file ("nominal.mass") -> its origin
  std::vector<std::string> remarks;            ///< what has no key of its own, or needs the reader's eye
  std::vector<std::string> files;              ///< that were read
  /// Key `columns`: places of the drive wheels' joints in a JointState, "velocity[left_wheel]".
  std::map<std::string, std::string> columns{};
};

/// The robot of a description (nullptr: none) and of a controller's parameters (nullptr: none); at least one is needed.
///
/// - The wheels are those of `hints`, of the controller, of the description's plugin, in this order, else found
///   (driven_wheels).
/// - Geometry: `hints` first, then the description's shapes and joints, then the controller, then a plugin. Two sources
///   that differ by more than a tenth are an error, by more than a thousandth a remark.
/// - nominal: m and I as lumped_body has them; with the damping c of the wheels' joints (N·m·s/rad),
///   f1 = (c_R + c_L)/r² and f3 = (c_R + c_L) D²/(4r²); `coulomb` is the mean of the joints' dry friction, and where it
///   is > 0 the model takes it as a parameter.
/// - A centre of mass more than a hundredth of the track off the middle of the axle is an effect of the robot,
///   com_longitudinal or com_lateral (a prior of [a/3, 3a]).
/// - limits: of effort from the wheels' joints and the plugin; of speed from the joints, and such that no pair of wheel
///   speeds within it exceeds a controller's limits, ω <= min(v/r, v2 D/(2r)); of acceleration likewise.
/// - columns: angle, speed and effort of the joints that drive each side, by their names.
/// - effort: from the interfaces of the wheels' joints; an effort that is only commanded is held (zero_order).
///
/// Throws InputError, naming file, line and element, for what is missing, contradicts itself or makes no sense.
[[nodiscard]] RobotWithOrigins robot_from(const RobotTree* description, const DriveFacts* controller,
                                          const RobotHints& hints = {});

/// The robot, its origins and remarks as JSON (results/robot-file.schema.json); `software` is name and version.
[[nodiscard]] Json to_json(const RobotWithOrigins& robot, const std::string& software);

/// The text of a robot file with an origin behind every value as a comment. parse_robot makes the same Robot of it.
[[nodiscard]] std::string robot_yaml(const RobotWithOrigins& robot);

}  // namespace wheelwright::robots

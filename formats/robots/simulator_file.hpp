// SPDX-License-Identifier: Apache-2.0
/// \file
/// Simulators' own files, MJCF, URDF and SDF, edited in place: numbers are replaced or added where a robot turned out
/// other than the file has it, and everything else stays byte for byte.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/files/json.hpp"
#include "model/robot.hpp"
#include "model/simulator_change.hpp"

namespace wheelwright::robots {

/// Format of a simulator's file.
enum class SimulatorFormat {
  mjcf,  ///< MuJoCo
  urdf,  ///< ROS, PyBullet, Isaac, Drake ...
  sdf,   ///< Gazebo
};

/// A number that was replaced or added.
struct NumberChanged {
  std::string where;    ///< "robot.xml:12", in the file that was read
  std::string element;  ///< "joint 'left'"
  std::string number;   ///< attribute or element: "frictionloss"
  std::string before;   ///< as it stood there; empty: it did not
  std::string after;
  std::string because;  ///< the causes
};

/// What the caller knows beside the file.
struct SimulatorHints {
  std::string left, right;  ///< joints of the driven wheels; empty: found as driven_wheels() does
};

/// An edited file.
struct EditedSimulator {
  SimulatorFormat format = SimulatorFormat::mjcf;
  std::string text;                                ///< of the whole file
  std::vector<NumberChanged> changed;              ///< in the order of the changes
  std::vector<model::NotExpressed> not_expressed;  ///< causes, or parts of them, that are not in `text`
  std::vector<std::string> remarks;                ///< where the file is not the model that was compared
  std::string right, left;                         ///< joints of the wheels
};

/// Makes `change` in `text`. Numbers are changed beside those that the file has. With the axle's middle P, the vertical
/// z through it and the heaviest link B that is fixed to the wheels' parent (mass M, centre c from P, tensor J):
///
/// - M' = M + Δm, c' = (M c + ΔS)/M' with the height kept, and z·J'z = z·Jz + ΔI − M'|z × c'|² + M|z × c|²: more is put
///   on the diagonal as that of a cube, less scales the tensor. Frames of inertials stay as they are.
/// - dry friction, damping and armature are added at the wheels' joints. URDF and SDF have no armature: it becomes the
///   moment of the wheel's link about its axle, that of a disc, and what that adds about z is taken from B.
/// - a wheel's radius is scaled in its round shapes, and its axle raised by as much, so that the other contacts keep
///   the ground; a link whose mass came from these shapes gets its old mass and moments as numbers.
/// - the track: both wheels move along the axle by half of what it grows.
/// - gain (MJCF): `gear` of a motor, the gains of other actuators. Limits: `forcerange`, `effort`.
///
/// MJCF: defaults, classes and the compiler's angles are followed; where a body's mass comes from its geoms' densities,
/// an explicit <inertial> is written. Masses that cannot be reckoned (meshes, `settotalmass`, inertiafromgeom="true")
/// are told in `not_expressed`. Throws InputError, naming file, line and element: for what is no such file, for
/// includes, frames, replicas and nested models, for xacro, and where the wheels are not found.
[[nodiscard]] EditedSimulator edit_simulator(SimulatorFormat format, std::string text, const std::string& file,
                                             const model::SimulatorChange& change, const Robot& robot,
                                             const SimulatorHints& hints = {});

/// "mjcf", "urdf", "sdf".
[[nodiscard]] const char* name_of(SimulatorFormat format);

/// The edit, without its text: {format, source, file, wheels, changed, not_expressed, remarks}, as gap.json has it.
[[nodiscard]] Json to_json(const EditedSimulator& edit, const std::string& source, const std::string& file);

}  // namespace wheelwright::robots

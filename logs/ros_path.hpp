// SPDX-License-Identifier: Apache-2.0
/// \file
/// Paths to the numbers of a message: "twist.twist.angular.z", "velocity[0]", "velocity[right_wheel]".
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <wheelwright/logs/ros_definition.hpp>

namespace wheelwright::ros {

/// One field of a path, and which of its elements.
struct PathStep {
  std::size_t field = 0;               ///< place among the fields of its message
  std::optional<std::uint32_t> index;  ///< of the element
  std::string element;                 ///< or its name, where the path has one; empty for a field that is no list

  bool operator==(const PathStep&) const = default;
};

/// From the message to the number.
using Path = std::vector<PathStep>;

/// Finds `path` in `definition`. Throws InputError "topic type: path: …", with the nearest name, unless it leads to a
/// number (bool, integer or floating-point) and has an index or a name for every list, and only for lists.
[[nodiscard]] Path find_path(const RosDefinition& definition, const std::string& path);

/// The field of strings that names the elements of `list` (both places among the fields of `message`):
/// "multi_dof_joint_names" for a field "multi_dof_…", else "name", "names", "joint_names" or "interface_names"; nothing
/// where there is none.
[[nodiscard]] std::optional<std::size_t> names_of(const RosMessage& message, std::size_t list);

}  // namespace wheelwright::ros

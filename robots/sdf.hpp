// SPDX-License-Identifier: Apache-2.0
/// \file
/// Robot descriptions in SDFormat.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include <wheelwright/robots/robot_description.hpp>

namespace wheelwright {

/// Reads the one model of an SDF file (inside a world or not) of SDF 1.4 or later: links with inertials and shapes,
/// joints with dynamics and limits, differential-drive plugins. Poses are resolved into the model's frame through
/// relative_to (links, joints, frames); a pose that is left out is the identity and a product of inertia that is left
/// out is 0, as SDF has it. SDF's other defaults (a mass of 1 kg, an inertia of 1 kg·m²) are errors here. Limits that
/// are negative, infinite or at least 10¹⁶ are none. Throws InputError, naming file, line and element, for what is not
/// there or makes no sense, and for <include> and nested models, which have to be flattened first.
[[nodiscard]] RobotTree read_sdf(const std::filesystem::path& path);

/// The same from text; `file` is for messages.
[[nodiscard]] RobotTree parse_sdf(std::string_view text, const std::string& file);

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Columns of a log that a robot's model asks for.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/model/robot.hpp>

namespace wheelwright::robots {

/// Columns that a robot of this model can use, so that a defect elsewhere in a file does no harm.
[[nodiscard]] std::vector<std::string> useful_columns(const Robot& robot);

/// Columns that commissioning needs, as require_columns() takes them: each joint's effort, and its speed or angle.
[[nodiscard]] std::vector<std::string> needed_columns(const Robot& robot);

}  // namespace wheelwright::robots

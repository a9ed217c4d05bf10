// SPDX-License-Identifier: Apache-2.0
/// \file
/// Logs of programs that name no columns of the log contract.
#pragma once

#include <string>
#include <vector>

namespace wheelwright::logs {

/// What to write where `fields` are those of a known program's log that names no columns of the log contract (VESC
/// Tool, ODrive), beginning with "; "; empty for others.
[[nodiscard]] std::string known_logger(const std::vector<std::string>& fields);

/// What to do with a table without a header whose first line is `fields`, beginning with "; ": where it is what
/// `ros2 topic echo --csv` writes of JointState (s, ns, frame, names, positions, speeds, efforts), the commands that
/// put one before the rows of `file`; for others that a recording has names.
[[nodiscard]] std::string headerless_logger(const std::vector<std::string>& fields, const std::string& file);

}  // namespace wheelwright::logs

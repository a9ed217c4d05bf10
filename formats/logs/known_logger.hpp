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

}  // namespace wheelwright::logs

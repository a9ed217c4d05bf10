// SPDX-License-Identifier: Apache-2.0
/// \file
/// Completion of commands, options and their values by a shell.
#pragma once

#include <string>

#include "command_tree.hpp"

namespace wheelwright::app {

/// A script for bash, zsh or fish (`shell`) that completes what `program` takes: commands, options, choices, files and
/// directories. Throws InputError for another shell.
[[nodiscard]] std::string completion(const ProgramWords& program, const std::string& shell);

}  // namespace wheelwright::app

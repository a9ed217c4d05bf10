// SPDX-License-Identifier: Apache-2.0
/// \file
/// Manual pages, section 1.
#pragma once

#include <string>

#include "app/command_tree.hpp"

namespace wheelwright::app {

/// The manual page of the program itself, in roff with the macros of man(7).
[[nodiscard]] std::string manual_page(const ProgramWords& program, const std::string& version);

/// That of one of its commands, wheelwright-COMMAND(1).
[[nodiscard]] std::string manual_page(const CommandWords& command, const std::string& version);

}  // namespace wheelwright::app

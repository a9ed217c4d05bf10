// SPDX-License-Identifier: Apache-2.0
/// \file
/// The choice of a detector as a table for a terminal.
#pragma once

#include <string>

#include "commission/choice/detector_choice.hpp"

namespace wheelwright::words {

/// The choice for a terminal: a table of all candidates, the stated faults, what each guarantee decides, and
/// `robot_file_line`, which asks for the chosen filter.
[[nodiscard]] std::string summary(const commission::DetectorChoice& choice, const std::string& robot_file_line);

}  // namespace wheelwright::words

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The examination of a log in lines for a terminal.
#pragma once

#include <string>

#include "commission/doctor/log_health.hpp"

namespace wheelwright::words {

/// The examination of a log for a terminal: findings, the gravest first (`all`: also what is as it should be), then the
/// verdict.
[[nodiscard]] std::string summary(const doctor::LogHealth& health, bool all = false);

}  // namespace wheelwright::words

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The examination of a log in lines for a terminal.
#pragma once

#include <functional>
#include <string>

#include "commission/doctor/log_health.hpp"

namespace wheelwright::words {

/// The examination of a log for a terminal: findings, the gravest first (`all`: also what is as it should be), then the
/// verdict. `clock` makes the moment by a wall clock of a time of the log (s), empty where there is none; it stands
/// beside places.
[[nodiscard]] std::string summary(const doctor::LogHealth& health, bool all = false,
                                  const std::function<std::string(double)>& clock = {});

}  // namespace wheelwright::words

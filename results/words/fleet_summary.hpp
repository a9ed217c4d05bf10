// SPDX-License-Identifier: Apache-2.0
/// \file
/// A fleet in sentences for a terminal.
#pragma once

#include <string>

#include "study/fleet_result.hpp"

namespace wheelwright::words {

/// The fleet for a terminal: its sentences, then why logs failed, the most frequent reasons first.
[[nodiscard]] std::string summary(const study::FleetResult& fleet);

}  // namespace wheelwright::words

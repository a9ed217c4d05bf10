// SPDX-License-Identifier: Apache-2.0
/// \file
/// Warrants and assumptions in JSON files.
#pragma once

#include <vector>

#include <wheelwright/core/warrant.hpp>
#include <wheelwright/files/json.hpp>

namespace wheelwright::results {

/// The list as results have it under `assumptions`.
[[nodiscard]] Json assumptions_json(const std::vector<core::Assumption>& assumptions);

}  // namespace wheelwright::results

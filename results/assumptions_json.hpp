// SPDX-License-Identifier: Apache-2.0
/// \file
/// Assumptions of a result as JSON.
#pragma once

#include <vector>

#include "core/warrant.hpp"
#include "formats/files/json.hpp"

namespace wheelwright::results {

/// The list as results have it under `assumptions`.
[[nodiscard]] Json assumptions_json(const std::vector<core::Assumption>& assumptions);

}  // namespace wheelwright::results

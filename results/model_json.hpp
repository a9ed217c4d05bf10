// SPDX-License-Identifier: Apache-2.0
/// \file
/// Warrants, assumptions and error classes in JSON files.
#pragma once

#include <vector>

#include <wheelwright/core/warrant.hpp>
#include <wheelwright/files/json.hpp>
#include <wheelwright/filter/error_class.hpp>

namespace wheelwright::results {

/// The list as results have it under `assumptions`.
[[nodiscard]] Json assumptions_json(const std::vector<core::Assumption>& assumptions);

/// Error classes as model.json has them under `at_risk/errors`.
[[nodiscard]] Json error_classes_json(const filter::ErrorClasses& classes);

}  // namespace wheelwright::results

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Numbers that may not be there, in results.
#pragma once

#include <cmath>
#include <optional>

#include <nlohmann/json.hpp>

#include <wheelwright/files/json_file.hpp>

namespace wheelwright {

/// `value`, or null where it is NaN or infinite.
[[nodiscard]] inline Json or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

/// The same of what may be absent.
[[nodiscard]] inline Json or_null(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// identification.json: the result of an identification.
#pragma once

#include <cstdint>
#include <string>

#include <wheelwright/files/json_file.hpp>
#include <wheelwright/inference/identification.hpp>
#include <wheelwright/logs/csv_report.hpp>

namespace wheelwright {

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kIdentificationSchema = "wheelwright/identification/1";

/// The whole result as JSON (results/identification.schema.json): θ_L in its own units throughout, and the physical quantities
/// beside it where the robot file tells their scale. `data` says which log it came from, `software` is name and
/// version, `seed` that of bootstrap and signs.
[[nodiscard]] Json to_json(const Identification& result, const LogReport& data, const std::string& software,
                           std::uint64_t seed);

}  // namespace wheelwright

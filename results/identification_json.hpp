// SPDX-License-Identifier: Apache-2.0
/// \file
/// identification.json: the result of an identification.
#pragma once

#include <cstdint>
#include <string>

#include "commission/identification.hpp"
#include "formats/files/json.hpp"
#include "formats/logs/recorded_log.hpp"

namespace wheelwright::results {

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kIdentificationSchema = "wheelwright/identification/1";

/// The whole result as JSON (results/identification.schema.json): θ_L in its own units throughout, and the physical
/// quantities beside it where the robot file tells their scale. `data` says which log it came from, `software` is name
/// and version, `seed` that of bootstrap and signs.
[[nodiscard]] Json to_json(const commission::Identification& result, const logs::LogReport& data,
                           const std::string& software, std::uint64_t seed);

}  // namespace wheelwright::results

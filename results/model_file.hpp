// SPDX-License-Identifier: Apache-2.0
/// \file
/// model.json: the result of commissioning, and the claims of it that `wheelwright check` verifies.
#pragma once

#include <string>

#include "commission/commission.hpp"
#include "formats/files/json.hpp"
#include "formats/logs/recorded_log.hpp"
#include "formats/robots/online_model_file.hpp"
#include "results/model_claims.hpp"

namespace wheelwright::results {

/// The whole result as JSON (results/model.schema.json). `data` says which log it came from, `software` is name and
/// version.
[[nodiscard]] Json to_json(const Commissioning& result, const logs::LogReport& data, const std::string& software);

}  // namespace wheelwright::results

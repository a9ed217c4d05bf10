// SPDX-License-Identifier: Apache-2.0
/// \file
/// margins.json: the result of `wheelwright margins`.
#pragma once

#include <string>

#include "commission/margin_survey.hpp"
#include "formats/files/json.hpp"

namespace wheelwright::results {

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kMarginsSchema = "wheelwright/margins/1";

/// The whole survey as JSON (results/margins.schema.json). `model` and `log` say what it was made of, `software` is
/// name and version.
[[nodiscard]] Json to_json(const commission::MarginSurvey& survey, const std::string& model, const std::string& log,
                           const std::string& software);

}  // namespace wheelwright::results

// SPDX-License-Identifier: Apache-2.0
/// \file
/// choice.json: the result of `wheelwright choose`.
#pragma once

#include <string>
#include <vector>

#include "commission/choice/detector_choice.hpp"
#include "formats/files/json.hpp"
#include "model/filter/measurement.hpp"

namespace wheelwright::results {

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kChoiceSchema = "wheelwright/choice/1";

/// The whole choice as JSON (results/choice.schema.json). `robot` and `logs` say what it was made of, `software` is
/// name and version.
[[nodiscard]] Json to_json(const commission::DetectorChoice& choice, const std::string& robot,
                           const std::vector<std::string>& logs, const std::string& software);

/// The line of a robot file that asks for this filter.
[[nodiscard]] std::string robot_file_line(const FilterDesign& filter);

}  // namespace wheelwright::results

// SPDX-License-Identifier: Apache-2.0
/// \file
/// margins.json and choice.json: the results of `wheelwright margins` and `wheelwright choose`.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/commission/detector_choice.hpp>
#include <wheelwright/commission/margin_survey.hpp>
#include <wheelwright/files/json.hpp>

namespace wheelwright::results {

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kMarginsSchema = "wheelwright/margins/1";

/// The whole survey as JSON (results/margins.schema.json). `model` and `log` say what it was made of, `software` is
/// name and version.
[[nodiscard]] Json to_json(const commission::MarginSurvey& survey, const std::string& model, const std::string& log,
                           const std::string& software);

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kChoiceSchema = "wheelwright/choice/1";

/// The whole choice as JSON (results/choice.schema.json). `robot` and `logs` say what it was made of, `software` is
/// name and version.
[[nodiscard]] Json to_json(const commission::DetectorChoice& choice, const std::string& robot,
                           const std::vector<std::string>& logs, const std::string& software);

/// The line of a robot file that asks for this filter.
[[nodiscard]] std::string robot_file_line(const FilterDesign& filter);

}  // namespace wheelwright::results

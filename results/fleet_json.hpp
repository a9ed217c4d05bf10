// SPDX-License-Identifier: Apache-2.0
/// \file
/// Records of robots as lines of JSON, both ways; fleet.json, fleet.csv and pooled_prior.yaml.
#pragma once

#include <string>
#include <string_view>

#include "formats/files/json.hpp"
#include "study/fleet_result.hpp"
#include "study/population.hpp"

namespace wheelwright::results {

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kFleetSchema = "wheelwright/fleet/1";

/// The record as one line of JSON, numbers as their shortest exact text: record_from_text() gives an equal record where
/// its numbers are finite and its texts UTF-8.
[[nodiscard]] std::string record_text(const study::RobotRecord& record);

/// RobotRecord::passing of what record_text() wrote, without reading the rest.
[[nodiscard]] bool is_passing(std::string_view record);

/// Reads what record_text() wrote. Throws InputError, naming `where` and the key, for anything else.
[[nodiscard]] study::RobotRecord record_from_text(std::string_view text, const std::string& where);

/// The judged fleet (results/fleet.schema.json): counts, population, robots outside, drift, alarms, what failed, pooled
/// prior. The robots' own numbers are in fleet.csv. `list` is what was examined, `software` name and version.
[[nodiscard]] Json to_json(const study::FleetResult& fleet, const std::string& list, const std::string& software);

/// The head of fleet.csv:
/// robot,status,parameter,unit,estimate,standard_error,lower,upper,lower_is_prior,upper_is_prior.
[[nodiscard]] std::string fleet_csv_header();

/// The rows of one robot, one for each parameter of its commissioning; one with empty fields where it has none.
[[nodiscard]] std::string fleet_csv_rows(const study::RobotRecord& record);

/// The key `prior:` as a robot file takes it, with every included parameter in digits that read back exactly, below
/// comments that state the coverage, what it rests on, and what is left out. Where there is no box, the comments say
/// why and the mapping is empty.
[[nodiscard]] std::string pooled_prior_yaml(const study::FleetResult& fleet, const std::string& software);

}  // namespace wheelwright::results

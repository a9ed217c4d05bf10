// SPDX-License-Identifier: Apache-2.0
/// \file
/// model.json: the result of commissioning, and the model that a detector reads back from it.
#pragma once

#include <filesystem>
#include <string>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/io/csv_report.hpp>
#include <wheelwright/io/json_file.hpp>

namespace wheelwright {

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kModelSchema = "wheelwright/model/1";

/// The whole result as JSON (io/model.schema.json). `data` says which log it came from, `software` is name and version.
[[nodiscard]] Json to_json(const Commissioning& result, const LogReport& data, const std::string& software);

/// Reads the on-line part of a model.json back. Throws InputError, naming file and key, when it is no such file, when it
/// holds no model (its status says why), or when a number is missing or impossible.
[[nodiscard]] CommissionedModel read_model(const std::filesystem::path& path);

/// The same from JSON; `file` is for messages.
[[nodiscard]] CommissionedModel model_from_json(const Json& json, const std::string& file);

}  // namespace wheelwright

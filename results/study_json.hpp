// SPDX-License-Identifier: Apache-2.0
/// \file
/// sensitivity.json: the result of `wheelwright sensitivity`.
#pragma once

#include <optional>
#include <string>

#include <wheelwright/files/json_file.hpp>
#include <wheelwright/results/study_file.hpp>
#include <wheelwright/study/local_derivatives.hpp>
#include <wheelwright/study/study.hpp>

namespace wheelwright {

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kSensitivitySchema = "wheelwright/sensitivity/1";

/// The study and its result as JSON (results/sensitivity.schema.json). `file` is the study file as it was named. Values that
/// are not there, and sizes of faults where none is certain, are null.
[[nodiscard]] Json to_json(const StudyFile& study, const StudyResult& result,
                           const std::optional<LocalSensitivity>& local, const std::string& file,
                           const std::string& software);

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Study files (YAML) and sensitivity.json: the question and the result of `wheelwright sensitivity`.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/log.hpp"
#include "formats/files/json.hpp"
#include "model/robot.hpp"
#include "study/bound_derivatives.hpp"
#include "study/study.hpp"

namespace wheelwright::results {

/// A study and what it was made of.
struct StudyFile {
  study::Study study;
  std::string text;                              ///< the file as it is
  std::vector<std::filesystem::path> sources{};  ///< scenario, logs and robot file, as far as it names them
  std::vector<std::string> notes{};              ///< what was chosen, for people
};

/// Reads a study file. `scenario` or `log`, and `inputs`, are needed:
///
///     name: TEXT
///     scenario: FILE                    driven anew at every point; or
///     log: FILE | [FILE, ...]           recorded
///     robot: FILE                       the robot file that is commissioned with; by default the scenario's robot
///     inputs:                           names as study_input_kinds() has them
///       NAME: [from, to]
///       NAME: {range: [from, to] | relative: [from, to], scale: linear | log, nominal: x}
///     quantities: [names]               as study_quantities() has them; by default its usual ones
///     window: s                         of smallest_fault (1)
///     methods:                          by default one_at_a_time, and local with it
///       local: true | false
///       one_at_a_time: {levels: 5}
///       morris: {trajectories: 20, levels: 4}
///       sobol: {points: 64, replicates: 8, confidence: 0.95}
///       grid: {levels: 5} | {levels: {NAME: 5, ...}}     inputs that are not named stay nominal
///     seed: 1                           of the designs
///
/// Files are relative to the study file. `relative` counts from the nominal value: [-0.02, 0.02] is from 2 % below it
/// to 2 % above. The nominal value is the subject's own where it has one inside the range, else the nearest end or,
/// without one, the middle of the range.
///
/// Throws InputError, naming file, line, key, value and what was expected, for unknown or repeated keys, wrong types
/// and impossible values.
[[nodiscard]] StudyFile read_study(const std::filesystem::path& path);

/// The same from text; `file` is for messages, other files are looked for in `folder`.
[[nodiscard]] StudyFile parse_study(std::string_view text, const std::string& file,
                                    const std::filesystem::path& folder = {});

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kSensitivitySchema = "wheelwright/sensitivity/1";

/// The study and its result as JSON (results/sensitivity.schema.json). `file` is the study file as it was named. Values
/// that are not there, and sizes of faults where none is certain, are null.
[[nodiscard]] Json to_json(const StudyFile& file, const study::StudyResult& result,
                           const std::optional<study::LocalSensitivity>& local, const std::string& name,
                           const std::string& software);

}  // namespace wheelwright::results

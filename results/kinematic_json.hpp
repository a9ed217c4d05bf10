// SPDX-License-Identifier: Apache-2.0
/// \file
/// The section `kinematic` of model.json, both ways.
#pragma once

#include <optional>

#include <wheelwright/commission/kinematic.hpp>
#include <wheelwright/files/json.hpp>

namespace wheelwright {

/// The section as JSON (results/model.schema.json, definition `kinematic`); nothing where the log had neither pose nor gyro.
[[nodiscard]] std::optional<Json> kinematic_json(const KinematicCommissioning& result, const FoldOptions& folds);

/// Reads the on-line part of the section at `place` back; nothing where it holds no model. Throws InputError, naming file
/// and key, when a number is missing or impossible.
[[nodiscard]] std::optional<KinematicModel> kinematic_from_json(const JsonPlace& place);

/// Whether each of the `outputs` of an object `noise` has the origin "declared", and there is one.
[[nodiscard]] bool all_declared(const JsonPlace& noise);

}  // namespace wheelwright

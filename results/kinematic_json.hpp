// SPDX-License-Identifier: Apache-2.0
/// \file
/// The section `kinematic` of model.json.
#pragma once

#include <optional>

#include <wheelwright/commission/kinematic.hpp>
#include <wheelwright/files/json.hpp>

namespace wheelwright::results {

/// The section as JSON (results/model.schema.json, definition `kinematic`); nothing where the log had neither pose nor
/// gyro.
[[nodiscard]] std::optional<Json> kinematic_json(const commission::KinematicCommissioning& result,
                                                 const commission::FoldOptions& folds);

}  // namespace wheelwright::results

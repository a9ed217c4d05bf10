// SPDX-License-Identifier: Apache-2.0
/// \file
/// The engine's models and states, owned.
#pragma once

#include <memory>
#include <string>

#include <mujoco/mujoco.h>

namespace wheelwright::reality {

/// Frees what the engine made.
struct FreeModel {
  void operator()(mjModel* model) const { mj_deleteModel(model); }
};
/// Likewise.
struct FreeData {
  void operator()(mjData* data) const { mj_deleteData(data); }
};
using Model = std::unique_ptr<mjModel, FreeModel>;
using Data = std::unique_ptr<mjData, FreeData>;

/// The model of an MJCF text, which refers to no files. Throws Error, with the engine's message, where it is rejected.
[[nodiscard]] Model compile(const std::string& xml);

}  // namespace wheelwright::reality

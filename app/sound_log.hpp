// SPDX-License-Identifier: Apache-2.0
/// \file
/// Logs that are examined before anything is made of them.
#pragma once

#include <filesystem>
#include <vector>

#include "model/robot.hpp"
#include "results/sound_log.hpp"

namespace wheelwright::app {

struct CommonOptions;

using results::kExaminedRows;
using results::SoundLog;
using results::WheelPose;

/// results::open_sound_log() with the reader's options and --despite.
[[nodiscard]] SoundLog open_sound_log(const std::vector<std::filesystem::path>& paths, const Robot& robot,
                                      const CommonOptions& options, WheelPose pose);

}  // namespace wheelwright::app

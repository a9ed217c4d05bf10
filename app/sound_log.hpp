// SPDX-License-Identifier: Apache-2.0
/// \file
/// Logs that are examined before anything is made of them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <wheelwright/core/log.hpp>
#include <wheelwright/doctor/log_health.hpp>
#include <wheelwright/logs/log_file.hpp>
#include <wheelwright/model/robot.hpp>

#include "common.hpp"

namespace wheelwright::app {

/// Rows by which a log is judged before a command uses it.
inline constexpr std::size_t kExaminedRows = 200000;

/// At most `most` rows of `log`, in memory; the log is rewound.
[[nodiscard]] LogTable first_rows(LogSource& log, std::size_t most);

/// What is done with a pose that only repeats the wheels.
enum class WheelPose {
  judged,  ///< kept: the command finds that out itself (commission)
  hidden,  ///< its columns are not read
};

/// A log whose units, signs and sides fit its robot.
struct SoundLog {
  std::unique_ptr<logs::RecordedLog> log;
  std::vector<std::string> remarks;  ///< what was hidden and why, and what was passed over; one sentence each
};

/// The log in `paths` with the columns that `robot` can use, after the doctor's checks of its first kExaminedRows:
/// where units, signs or sides cannot be right, InputError names the findings, and what to do. CommonOptions::despite
/// passes over findings by their names. Other fatal findings (nothing excited, a dead signal, efforts late) are left to
/// the commands, which have an answer of their own to each. A log that lacks columns is not examined. Throws as
/// open_log().
[[nodiscard]] SoundLog open_sound_log(const std::vector<std::filesystem::path>& paths, const Robot& robot,
                                      const CommonOptions& options, WheelPose pose);

}  // namespace wheelwright::app

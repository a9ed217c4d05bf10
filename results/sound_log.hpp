// SPDX-License-Identifier: Apache-2.0
/// \file
/// Logs that are examined before anything is made of them.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "formats/logs/log_file.hpp"
#include "formats/logs/recorded_log.hpp"
#include "model/robot.hpp"

namespace wheelwright::results {

/// Rows by which a log is judged before a command uses it.
inline constexpr std::size_t kExaminedRows = 200000;

/// What is done with a pose that only repeats the wheels.
enum class WheelPose {
  judged,  ///< kept: the command finds that out itself (commission)
  hidden,  ///< its columns are not read
};

/// A log that is what its robot file says.
struct SoundLog {
  std::unique_ptr<logs::RecordedLog> log;
  Robot robot;                       ///< as declared, with what the log itself shows of its sensors
  std::vector<std::string> remarks;  ///< what was hidden and why, what was passed over, and an odd scale of the efforts
};

/// The log in `paths` with the columns that `robot` can use, after the doctor's checks of its first kExaminedRows: for
/// findings that refuse it (LogFinding::is_refusal()) InputError names them, and what to do. `despite` passes over
/// findings by their names. Other fatal findings (nothing excited, a dead signal, efforts that are far too late) are
/// left to the callers, which have an answer of their own to each. Even samples behind scattered stamps are read by
/// their own clock, and (where the pose is judged) efforts that are a little late are taken for late: SoundLog::robot
/// and a remark say so. A log that lacks columns is not examined. Throws as open_log().
[[nodiscard]] SoundLog open_sound_log(const std::vector<std::filesystem::path>& paths, const Robot& robot,
                                      logs::LogOptions reader, const std::vector<std::string>& despite, WheelPose pose,
                                      std::size_t threads = 1);

}  // namespace wheelwright::results

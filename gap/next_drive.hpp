// SPDX-License-Identifier: Apache-2.0
/// \file
/// The next drive to record: the one that discriminates between the causes that a log leaves possible.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "gap/effects/effect.hpp"
#include "gap/rival.hpp"
#include "model/robot.hpp"

namespace wheelwright::gap {

struct Diagnosis;
struct DiagnoseOptions;

/// The next drive to record.
struct NextDrive {
  std::vector<Rival> rivals;         ///< members of the credible set as fitted to the log, in its order
  std::vector<Effect> laws;          ///< that their causes follow, one of each name
  std::optional<LogTable> commands;  ///< of the wheels; nothing where no drive tells any two of the rivals apart
  std::string sentence;              ///< what the drive promises, and what no drive can
};

/// Designs the drive for the credible set of `diagnosis`, the first few members of it: each fitted to the log again, of
/// the robot and options that diagnosed it. Limits are those of the robot file; where it has none, what the log itself
/// drove: speeds, accelerations, and with a pose the distance from the start. Four fifths of the effort are planned
/// with, for the controller to have the rest. It lasts a third of the log, between 20 and 60 s. Where too few members
/// can be planned for in seconds, having shapes by the hundred, the sentence has the measurement that would split them.
[[nodiscard]] NextDrive next_drive(LogSource& log, LogSource* baseline, const Robot& robot, const Diagnosis& diagnosis,
                                   const DiagnoseOptions& options);

/// next_drive() where `diagnosis` is ambiguous; what hinders it, or what no drive can tell, becomes a note of it.
[[nodiscard]] NextDrive what_next(LogSource& log, LogSource* baseline, const Robot& robot, Diagnosis& diagnosis,
                                  const DiagnoseOptions& options);

}  // namespace wheelwright::gap

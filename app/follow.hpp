// SPDX-License-Identifier: Apache-2.0
/// \file
/// detect --follow: rows from standard input as they come.
#pragma once

#include <filesystem>

#include "app/common.hpp"
#include "detector/detector.hpp"
#include "detector/learnt_model.hpp"
#include "formats/logs/csv_format.hpp"

namespace wheelwright::app {

/// The value of `schema` in the line that each run appends to FollowOptions::events before all others.
inline constexpr const char* kEventsSchema = "wheelwright/events/1";

/// Options of follow().
struct FollowOptions {
  bool json = false;             ///< one JSON object a line in place of text
  double heartbeat = 0.0;        ///< s of the rows' clock between lines that say it is watching; 0: none
  std::filesystem::path events;  ///< JSON lines are appended to this file, too; empty: none
  bool fresh = false;            ///< what `events` holds is dropped before
};

/// Reads CSV rows from the open descriptor `stream`, which messages call standard input, until its end and writes an
/// event to standard output at the instant its alarm is raised: a line of text, or one JSON object a line. A row that
/// cannot be used is told on standard error and left out. Throws InputError where FollowOptions::events cannot be
/// written or is another run's, OutputLost where standard output cannot.
/// Returns kDone, kNo where there was an event, or kBadInput where the torque residual was not decided at any row, at
/// none of the last ones, or at less than half of all, with the reason on standard error: a spell without decisions
/// (commission::BlindWatch) is written there, too, when it is noticed and when it is over, and so is a time of 5 s (of
/// 20 rows at the model's rate, where that is longer) by the machine's clock in which no row comes. The kinematic
/// residual is watched with `options` where the model and the rows have it; on standard error it is said when the rows
/// lack its columns.
ExitCode follow(int stream, TorqueDetector detector, const OnlineModel& model, const detector::DetectorOptions& options,
                const logs::CsvOptions& reader, const FollowOptions& how);

}  // namespace wheelwright::app

// SPDX-License-Identifier: Apache-2.0
/// \file
/// detect --follow: rows from standard input as they come.
#pragma once

#include <ostream>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/logs/csv_format.hpp>

#include "common.hpp"

namespace wheelwright::app {

/// Reads CSV rows from the open descriptor `stream`, which messages call standard input, until its end and writes an
/// event to `out` at the instant its alarm is raised: a line of text, or with `json` one JSON object a line. A row that
/// cannot be used is told on standard error and left out.
/// Returns kDone, kNo where there was an event, or kBadInput where the torque residual was not decided at any row, or
/// at none of the last ones, with the reason on standard error: a spell without decisions (commission::BlindWatch) is
/// written to `out`, too, when it is noticed and when it is over, and so is a time of 5 s (of 20 rows at the model's
/// rate, where that is longer) by the machine's clock in which no row comes. The kinematic residual is watched with
/// `options` where the model and the rows have it; on standard error it is said when the rows lack its columns.
ExitCode follow(int stream, std::ostream& out, TorqueDetector detector, const OnlineModel& model,
                const detector::DetectorOptions& options, const logs::CsvOptions& reader, bool json);

}  // namespace wheelwright::app

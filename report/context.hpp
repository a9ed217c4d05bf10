// SPDX-License-Identifier: Apache-2.0
/// \file
/// Context of a report: the origin of its result, and the signals behind it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <wheelwright/commission/detector_walk.hpp>
#include <wheelwright/core/log.hpp>

namespace wheelwright::report {

/// A seed that was used, and for what.
struct ReportSeed {
  std::string purpose;
  std::uint64_t value = 0;
};

/// Where a result came from. Every text may hold anything: it is escaped on the page.
struct ReportContext {
  std::string title;                   ///< heading of the page; empty: a default with the robot's name
  std::vector<std::string> log_files;  ///< as the user gave them
  std::vector<ReportSeed> seeds;
  std::string software;               ///< name and version, e.g. "wheelwright 0.1.0"
  std::string command_line;           ///< what makes this page again
  std::vector<std::string> warnings;  ///< what the log reader repaired or split, one sentence each
  std::optional<LogTable> signals;    ///< raw signals; more than 2·10⁶ rows are thinned on the page, peaks kept
  std::size_t rows = 0;               ///< of the log, where it has more of them than `signals`
  std::optional<Detection> own_log;   ///< commission_report: the model's detector on the log it was made from
};

}  // namespace wheelwright::report

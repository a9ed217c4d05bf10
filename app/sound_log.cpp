// SPDX-License-Identifier: Apache-2.0
#include "sound_log.hpp"

#include <algorithm>

#include <fmt/format.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/results/health_json.hpp>
#include <wheelwright/robots/robot_file.hpp>

namespace wheelwright::app {
LogTable first_rows(LogSource& log, std::size_t most) {
  LogTable table;
  table.names = log.columns();
  table.columns.resize(table.names.size());
  LogBlock block;
  log.rewind();
  while (table.rows() < most && log.next(block)) {
    const std::size_t take = std::min(block.rows(), most - table.rows());
    for (const std::size_t start : block.segment_starts) {
      if (start < take) {
        table.segment_starts.push_back(table.rows() + start);
      }
    }
    for (std::size_t c = 0; c < table.columns.size(); ++c) {
      table.columns[c].insert(table.columns[c].end(), block.columns[c].begin(),
                              block.columns[c].begin() + static_cast<std::ptrdiff_t>(take));
    }
    table.t.insert(table.t.end(), block.t.begin(), block.t.begin() + static_cast<std::ptrdiff_t>(take));
  }
  log.rewind();
  return table;
}

SoundLog open_sound_log(const std::vector<std::filesystem::path>& paths, const Robot& robot,
                        const CommonOptions& options, WheelPose pose) {
  SoundLog out;
  logs::LogOptions reader = robot_reader(robot, options);
  out.log = logs::open_log(paths, reader);
  const doctor::LogHealth health =
      doctor::examine(first_rows(*out.log, kExaminedRows), robot, results::reader_counts(out.log->report()));
  std::string wrong;
  std::vector<std::string> names;
  for (const doctor::LogFinding& finding : health.findings) {
    if (finding.severity != doctor::FindingSeverity::fatal || finding.topic != doctor::FindingTopic::units) {
      continue;
    }
    if (std::ranges::count(options.despite, finding.id) > 0) {
      out.remarks.push_back(fmt::format("passed over {}: {}", finding.id, finding.sentence));
      continue;
    }
    wrong += fmt::format("\n  {}: {} {}", finding.id, finding.sentence, finding.next);
    if (std::ranges::count(names, finding.id) == 0) {
      names.push_back(finding.id);
    }
  }
  if (!wrong.empty()) {
    throw InputError(
        fmt::format("{}: the log does not fit the robot file:{}\n`wheelwright doctor` says more; "
                    "--despite {} goes on all the same",
                    paths.front().string(), wrong, fmt::join(names, " --despite ")));
  }
  const doctor::LogFinding* repeats = health.find("signals.pose_repeats_wheels");
  if (repeats != nullptr && pose == WheelPose::hidden) {
    std::erase_if(*reader.only,
                  [&](const std::string& name) { return std::ranges::count(repeats->columns, name) > 0; });
    out.log = logs::open_log(paths, reader);
    out.remarks.push_back(fmt::format("{} It is not used.", repeats->sentence));
  }
  return out;
}

}  // namespace wheelwright::app

// SPDX-License-Identifier: Apache-2.0
#include "results/sound_log.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

#include "commission/doctor/log_health.hpp"
#include "core/error.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/health_json.hpp"

namespace wheelwright::results {

SoundLog open_sound_log(const std::vector<std::filesystem::path>& paths, const Robot& robot, logs::LogOptions reader,
                        const std::vector<std::string>& despite, WheelPose pose, std::size_t threads) {
  reader.only = robots::useful_columns(robot);
  SoundLog out;
  out.robot = robot;
  out.log = logs::open_log(paths, reader);
  const doctor::LogHealth health =
      doctor::examine(read_all(*out.log, kExaminedRows), robot, reader_counts(out.log->report()), threads);
  std::string wrong;
  std::vector<std::string> names;
  for (const doctor::LogFinding& finding : health.findings) {
    if (!finding.is_refusal()) {
      continue;
    }
    if (std::ranges::count(despite, finding.id) > 0) {
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
        fmt::format("{}: the log does not fit the robot file:{}\n  `wheelwright doctor` says more; "
                    "--despite {} goes on all the same",
                    paths.front().string(), wrong, fmt::join(names, " --despite ")));
  }
  const doctor::LogFinding* repeats = health.find("signals.pose_repeats_wheels");
  if (repeats != nullptr && pose == WheelPose::hidden) {
    std::erase_if(*reader.only,
                  [&](const std::string& name) { return std::ranges::count(repeats->columns, name) > 0; });
    auto without_pose = logs::open_log(paths, reader);
    for (std::size_t k = 0; k < paths.size(); ++k) {
      if (without_pose->report().files[k].hash != out.log->report().files[k].hash) {
        throw InputError(paths[k].string() + ": was replaced while it was read: expected a log that is complete");
      }
    }
    out.log = std::move(without_pose);
    out.remarks.push_back(fmt::format("{} It is not used.", repeats->sentence));
  }
  return out;
}

}  // namespace wheelwright::results

// SPDX-License-Identifier: Apache-2.0
#include "results/sound_log.hpp"

#include <algorithm>
#include <array>
#include <iterator>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "commission/doctor/log_health.hpp"
#include "core/error.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/health_json.hpp"

namespace wheelwright::results {
namespace {

// Whether what is found in spite of this finding may be wrong: then every command says it.
bool doubts_result(const doctor::LogFinding& finding) {
  constexpr std::array<std::string_view, 7> ids = {"signals.wheels_disagree", "signals.saturation", "signals.stuck",
                                                   "signals.rounded",         "signals.stale",      "time.gyro_delay",
                                                   "time.pose_delay"};
  return finding.severity == doctor::FindingSeverity::warning && !finding.hides && !finding.speed_cut &&
         (finding.topic == doctor::FindingTopic::units || std::ranges::count(ids, finding.id) > 0);
}

}  // namespace

SoundLog open_sound_log(const std::vector<std::filesystem::path>& paths, const Robot& robot, logs::LogOptions reader,
                        const std::vector<std::string>& despite, WheelPose pose, std::size_t threads) {
  reader.only = robots::useful_columns(robot);
  reader.heading_offset = robot.heading_offset;
  reader.clock = robot.clock;
  SoundLog out;
  out.robot = robot;
  out.log = logs::open_log(paths, reader);
  const doctor::LogHealth health =
      doctor::examine(read_all(*out.log, kExaminedRows), robot, reader_counts(out.log->report()), threads);
  std::string wrong;
  std::vector<std::string> names;
  for (const doctor::LogFinding& finding : health.findings) {
    if (!finding.is_refusal()) {
      if (doubts_result(finding)) {
        out.remarks.push_back(fmt::format("{}: {} {}", finding.id, finding.sentence, finding.next));
      }
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
  for (const doctor::LogFinding& finding : health.findings) {
    if (finding.speed_filter || finding.speed_cut) {
      out.robot.speed_filter = finding.speed_filter ? finding.speed_filter : out.robot.speed_filter;
      out.robot.speed_cut = finding.speed_cut ? finding.speed_cut : out.robot.speed_cut;
      out.remarks.push_back(fmt::format("{}: {} {}", finding.id, finding.sentence, finding.next));
    }
  }
  std::vector<std::string> hidden;
  for (const doctor::LogFinding& finding : health.findings) {
    const bool repeats = finding.id == "signals.pose_repeats_wheels" && pose == WheelPose::hidden;
    if (repeats || finding.hides) {
      std::ranges::copy(finding.columns, std::back_inserter(hidden));
      out.remarks.push_back(finding.sentence + (repeats ? " It is not used." : ""));
    }
  }
  bool again = !hidden.empty();
  std::erase_if(*reader.only, [&](const std::string& name) { return std::ranges::count(hidden, name) > 0; });
  if (const doctor::LogFinding* turned = health.find("units.heading_offset")) {
    out.robot.heading_offset += turned->value;
    if (std::optional<double>& heading = out.robot.noise.heading.value) {
      *heading += 0.5 * (turned->taken->upper - turned->taken->lower);
    }
    reader.heading_offset = out.robot.heading_offset;
    out.remarks.push_back(fmt::format("{} {}", turned->sentence, turned->next));
    again = true;
  }
  if (again) {
    auto reopened = logs::open_log(paths, reader);
    for (std::size_t k = 0; k < paths.size(); ++k) {
      if (reopened->report().files[k].hash != out.log->report().files[k].hash) {
        throw InputError(paths[k].string() + ": was replaced while it was read: expected a log that is complete");
      }
    }
    out.log = std::move(reopened);
  }
  for (const doctor::LogFinding& finding : health.findings) {
    const bool late = finding.taken && (finding.id == "time.effort_delay" || finding.id == "signals.speed_filter");
    if (pose == WheelPose::judged && (late || finding.effort_smoothing)) {
      out.robot.effort_delay = late ? *finding.taken : out.robot.effort_delay;
      out.robot.effort_smoothing = finding.effort_smoothing.value_or(out.robot.effort_smoothing);
      out.robot.effort_time_origin = model::EffortTimeOrigin::found;
      out.remarks.push_back(finding.sentence);
    }
  }
  if (health.clock) {
    out.log = logs::read_evenly(std::move(out.log), *health.clock);
    out.robot.clock = health.clock;
    out.remarks.push_back(health.find("time.even_clock")->sentence);
  }
  return out;
}

}  // namespace wheelwright::results

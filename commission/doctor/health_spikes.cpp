// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "commission/doctor/health_efforts.hpp"
#include "commission/doctor/log_health.hpp"
#include "core/leaps.hpp"

namespace wheelwright::doctor {
namespace {

LogFinding leaping(std::size_t rows, std::string sentence, std::string next) {
  return {.id = "signals.spikes",
          .topic = FindingTopic::signals,
          .severity = FindingSeverity::warning,
          .sentence = std::move(sentence),
          .next = std::move(next),
          .value = static_cast<double>(rows),
          .unit = "rows"};
}

void tell_spikes(const HealthView& view, const std::string& name, const std::vector<double>* column, double share,
                 std::vector<LogFinding>& findings) {
  if (column == nullptr) {
    return;
  }
  const std::vector<bool> flagged =
      core::leaps_in(*column, view.segments, core::least_leap(*column, view.segments, share));
  const auto rows = static_cast<std::size_t>(std::ranges::count(flagged, true));
  if (rows == 0) {
    return;
  }
  const auto first = static_cast<std::size_t>(std::ranges::find(flagged, true) - flagged.begin());
  LogFinding f =
      leaping(rows,
              fmt::format("{} leaps away and back in {} row{}, first to {:.4g} from {:.4g}: no wheel moves so.", name,
                          rows, rows == 1 ? "" : "s", (*column)[first], (*column)[first - 1]),
              "");
  f.columns = {name};
  set_stretches(f, view, flagged, 1.5 * view.step);
  f.next = fmt::format(
      "Leave these rows out of the log: a value that is not meant makes bounds wide, or wrong. "
      "`wheelwright convert LOG rest.csv{}`{} does so.",
      without_arguments(f), f.stretches > f.when.size() ? " and the others" : "");
  findings.push_back(std::move(f));
}

}  // namespace

void check_spikes(const HealthView& view, const ReaderCounts& reader, std::vector<LogFinding>& findings) {
  if (reader.leaps > 0) {
    findings.push_back(leaping(
        reader.leaps,
        fmt::format("{} of {} rows were left out: a speed, rate, angle or effort leaps away and back within them. The "
                    "first is at "
                    "{}.",
                    reader.leaps, reader.rows_read, reader.first_leap),
        "Only `detect` and `convert` read them; elsewhere they are bridged as lost rows are. Look for what disturbs "
        "the sensor or its bus."));
  }
  for (const JointView& joint : view.joints) {
    tell_spikes(view, joint.angle_name, joint.angle, core::kAngleLeap, findings);
    tell_spikes(view, joint.speed_name, joint.speed, core::kSpeedLeap, findings);
    tell_spikes(view, joint.effort_name, joint.effort, core::kEffortLeap, findings);
  }
  tell_spikes(view, "gyro_z", view.column("gyro_z"), core::kRateLeap, findings);
}

}  // namespace wheelwright::doctor

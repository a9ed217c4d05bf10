// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "commission/doctor/log_health.hpp"
#include "core/statistics.hpp"

namespace wheelwright::doctor {
namespace {

constexpr double kTimesTheirUsual = 10.0;  // the 99 % quantile of changes from row to row
constexpr double kSpeedShare = 0.5;        // of the size of speeds and rates (99.9 % quantile), there and back
constexpr double kEffortShare = 3.0;       // of that of efforts, which a controller may well jerk
constexpr double kBackAgain = 0.5;         // of the jump, by which the row after may differ from the row before
constexpr std::size_t kLongestSpike = 2;   // rows

// Rows of `column` that lie far off those before and after.
std::vector<bool> spikes_of(const HealthView& view, const std::vector<double>& column, double share) {
  std::vector<double> changes, sizes;
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first; k < last; ++k) {
      sizes.push_back(std::abs(column[k]));
      if (k > first) {
        changes.push_back(std::abs(column[k] - column[k - 1]));
      }
    }
  }
  const double least =
      std::max(kTimesTheirUsual * quantile(std::move(changes), 0.99), share * quantile(std::move(sizes), 0.999));
  std::vector<bool> flagged(column.size(), false);
  if (!(least > 0.0)) {
    return flagged;
  }
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first + 1; k + 1 < last; ++k) {
      for (std::size_t rows = 1; rows <= kLongestSpike && k + rows < last; ++rows) {
        const double there = column[k] - column[k - 1], back = column[k + rows - 1] - column[k + rows];
        if (there * back > 0.0 && std::min(std::abs(there), std::abs(back)) > least &&
            std::abs(column[k + rows] - column[k - 1]) < kBackAgain * std::min(std::abs(there), std::abs(back))) {
          std::fill_n(flagged.begin() + static_cast<std::ptrdiff_t>(k), rows, true);
          break;
        }
      }
    }
  }
  return flagged;
}

void tell_spikes(const HealthView& view, const std::string& name, const std::vector<double>* column, double share,
                 std::vector<LogFinding>& findings) {
  if (column == nullptr) {
    return;
  }
  const std::vector<bool> flagged = spikes_of(view, *column, share);
  const auto rows = std::ranges::count(flagged, true);
  if (rows == 0) {
    return;
  }
  const auto first = static_cast<std::size_t>(std::ranges::find(flagged, true) - flagged.begin());
  LogFinding f{.id = "signals.spikes",
               .topic = FindingTopic::signals,
               .severity = FindingSeverity::warning,
               .next = "Leave these rows out of the log: a value that is not meant makes bounds wide, or wrong.",
               .columns = {name},
               .value = static_cast<double>(rows),
               .unit = "rows"};
  f.sentence = fmt::format("{} leaps away and back in {} row{}, first to {:.4g} from {:.4g}: as nothing that moves.",
                           name, rows, rows == 1 ? "" : "s", (*column)[first], (*column)[first - 1]);
  set_stretches(f, view, flagged, 1.5 * view.step);
  findings.push_back(std::move(f));
}

}  // namespace

void check_spikes(const HealthView& view, std::vector<LogFinding>& findings) {
  for (const JointView& joint : view.joints) {
    tell_spikes(view, joint.angle_name, joint.angle, 0.0, findings);
    tell_spikes(view, joint.speed_name, joint.speed, kSpeedShare, findings);
    tell_spikes(view, joint.effort_name, joint.effort, kEffortShare, findings);
  }
  tell_spikes(view, "gyro_z", view.column("gyro_z"), 1.0, findings);
}

}  // namespace wheelwright::doctor

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/fleet_result.hpp>

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/format.h>

#include <wheelwright/core/statistics.hpp>

namespace wheelwright::study {
namespace {

template <typename Items, typename Keep>
std::size_t different_robots(const Items& items, const Keep& keep) {
  std::set<std::size_t> robots;
  for (const auto& item : items) {
    if (keep(item)) {
      robots.insert(item.robot);
    }
  }
  return robots.size();
}

void take_width(FleetResult& fleet, const RecordedOutput& output, std::size_t robot) {
  auto found = std::ranges::find_if(
      fleet.widths, [&](const FleetSpread& s) { return s.name == output.name && s.unit == output.unit; });
  if (found == fleet.widths.end()) {
    fleet.widths.push_back({.name = output.name, .unit = output.unit});
    found = std::prev(fleet.widths.end());
  }
  found->values.push_back(output.median_width);
  if (output.median_width > found->largest) {
    found->largest = output.median_width;
    found->largest_robot = robot;
  }
}

void take_check(FleetResult& fleet, const CheckRecord& check, std::size_t robot) {
  ++fleet.logs;
  fleet.checked += check.checked ? 1 : 0;
  fleet.seconds += check.log.seconds;
  if (check.log.status == RobotStatus::unreadable) {
    fleet.failed.push_back({robot, check.log.log, check.log.message});
  } else if (check.log.status == RobotStatus::contradicted) {
    fleet.failed.push_back({robot, check.log.log, "contradicts the model by itself: " + check.log.message});
  }
  if (!check.checked && check.log.status != RobotStatus::unreadable) {
    fleet.failed.push_back({robot, check.log.log, "not checked: " + check.not_checked});
  }
  if (check.events > 0) {
    fleet.alarms.push_back({robot, check.log.log, check.events, check.first.value_or(0.0), check.outside_share});
  }
}

std::string robots(std::size_t n) { return fmt::format("{} robot{}", n, n == 1 ? "" : "s"); }

}  // namespace

double FleetSpread::quantile(double share) const {
  if (values.empty()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto rank =
      static_cast<std::size_t>(std::clamp(share, 0.0, 1.0) * static_cast<double>(values.size() - 1) + 0.5);
  return core::order_statistic(values, rank);
}

std::size_t FleetResult::robots_outside() const {
  return different_robots(population.outside, [](const auto&) { return true; });
}

std::size_t FleetResult::robots_drifting() const {
  return different_robots(drift, [&](const ParameterDrift& d) { return d.drifts(drift_level); });
}

std::size_t FleetResult::robots_drifting_for_certain() const {
  return different_robots(drift, [](const ParameterDrift& d) { return d.certain != 0.0; });
}

std::size_t FleetResult::robots_alarmed() const {
  return different_robots(alarms, [](const auto&) { return true; });
}

bool FleetResult::well() const {
  return population.outside.empty() && robots_drifting() == 0 && alarms.empty() && failed.empty();
}

void take(FleetResult& fleet, const RobotRecord& record) {
  const std::size_t robot = fleet.table.robots.size();
  add(fleet.table, record);
  const LogRecord& own = record.commissioning;
  ++fleet.by_status[static_cast<std::size_t>(own.status)];
  ++fleet.logs;
  fleet.seconds += own.seconds;
  if (own.status != RobotStatus::commissioned && own.status != RobotStatus::partial) {
    fleet.failed.push_back({robot, own.log, own.message});
  }
  for (const std::string& finding : record.findings) {
    fleet.failed.push_back({robot, {}, finding});
  }
  for (const RecordedOutput& output : record.outputs) {
    take_width(fleet, output, robot);
  }
  if (record.smallest_radius_change) {
    fleet.smallest.values.push_back(*record.smallest_radius_change);
    if (*record.smallest_radius_change > fleet.smallest.largest) {
      fleet.smallest.largest = *record.smallest_radius_change;
      fleet.smallest.largest_robot = robot;
    }
  }
  for (const CheckRecord& check : record.checks) {
    take_check(fleet, check, robot);
  }
  for (const ParameterDrift& drift : drift_of(record, robot, fleet.table)) {
    fleet.drift.push_back(drift);
  }
}

void judge_fleet(FleetResult& fleet, const FleetOptions& options) {
  fleet.drift_level = options.drift_level;
  fleet.population = describe_population(fleet.table, options.population);
  judge_drift(fleet.drift);
  fleet.prior = pooled_prior(fleet.table, options.prior);
}

std::vector<std::string> sentences(const FleetResult& fleet) {
  const std::size_t all = fleet.table.robots.size();
  const std::size_t partial = fleet.count(RobotStatus::partial);
  std::vector<std::string> out;
  out.push_back(fmt::format("{} of {} were commissioned{}", fleet.count(RobotStatus::commissioned) + partial,
                            robots(all), partial == 0 ? "." : fmt::format(", {} of them in part.", partial)));
  const std::size_t contradicted = fleet.count(RobotStatus::contradicted), nothing = fleet.count(RobotStatus::nothing),
                    unreadable = fleet.count(RobotStatus::unreadable);
  if (contradicted + nothing + unreadable > 0) {
    out.push_back(fmt::format(
        "{} contradict the model, {} show no parameter, {} could not be read: each is listed with its reason.",
        contradicted, nothing, unreadable));
  }
  const std::size_t outside = fleet.robots_outside();
  const auto sure = different_robots(fleet.population.outside, [](const auto& o) { return o.certain; });
  out.push_back(
      fleet.population.tests == 0 ? std::string("Too few robots show a parameter for a population to compare with.")
      : outside == 0              ? std::string("No robot stands outside the others.")
                                  : fmt::format("{} outside the others, {} of them for certain.",
                                   outside == 1 ? "1 robot stands" : fmt::format("{} robots stand", outside), sure));
  if (!fleet.drift.empty()) {
    const std::size_t drifting = fleet.robots_drifting(), certain = fleet.robots_drifting_for_certain();
    out.push_back(drifting == 0
                      ? std::string("No robot drifts from log to log.")
                      : fmt::format("{} from log to log, {} of them for certain.",
                                    drifting == 1 ? "1 robot drifts" : fmt::format("{} robots drift", drifting),
                                    certain));
  }
  if (fleet.checked > 0) {
    out.push_back(fleet.alarms.empty() ? fmt::format("{} later logs raised no alarm.", fleet.checked)
                                       : fmt::format("{} of {} later logs raised alarms, of {}.", fleet.alarms.size(),
                                                     fleet.checked, robots(fleet.robots_alarmed())));
  }
  out.push_back((fleet.prior.exists ? "Pooled prior: " : "No pooled prior: ") + fleet.prior.message + ".");
  return out;
}

}  // namespace wheelwright::study

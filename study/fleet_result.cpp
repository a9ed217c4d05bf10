// SPDX-License-Identifier: Apache-2.0
#include "study/fleet_result.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include <fmt/format.h>

#include "core/statistics.hpp"
#include "core/words.hpp"
#include "study/population.hpp"

namespace wheelwright::study {
namespace {

constexpr double days_a_week = 7.0;
constexpr double worth_of_a_median = 0.37;
constexpr std::size_t fewest_pairs = 10;  // robots with two logs that teach how much logs differ

void take_certain(ParameterDrift& drift, std::span<const DriftPoint> points) {
  for (std::size_t a = 0; a < points.size(); ++a) {
    for (std::size_t b = a + 1; b < points.size(); ++b) {
      const double up = core::round_down(points[b].lower - points[a].upper);
      const double down = core::round_up(points[b].upper - points[a].lower);
      const double change = up > 0.0 ? up : down < 0.0 ? down : 0.0;
      if (std::abs(change) > std::abs(drift.certain)) {
        drift.certain = change;
        drift.certain_from = points[a].when;
        drift.certain_to = points[b].when;
      }
    }
  }
}

void take_line(ParameterDrift& drift, std::span<const DriftPoint> points, double unit) {
  double weight = 0.0, time = 0.0, value = 0.0, used = 0.0;
  const auto usable = [](const DriftPoint& p) {
    return std::isfinite(p.estimate) && std::isfinite(p.standard_error) && p.standard_error > 0.0;
  };
  const double origin = points.front().when;
  const auto t = [&](const DriftPoint& p) { return (p.when - origin) / unit; };
  for (const DriftPoint& p : points) {
    if (usable(p)) {
      const double w = 1.0 / (p.standard_error * p.standard_error);
      weight += w;
      time += w * t(p);
      value += w * p.estimate;
      used += 1.0;
    }
  }
  if (used < 2.0) {
    return;
  }
  time /= weight;
  value /= weight;
  double tt = 0.0, tx = 0.0;
  for (const DriftPoint& p : points) {
    if (usable(p)) {
      const double w = 1.0 / (p.standard_error * p.standard_error);
      tt += w * (t(p) - time) * (t(p) - time);
      tx += w * (t(p) - time) * (p.estimate - value);
    }
  }
  if (!(tt > 0.0)) {
    return;
  }
  drift.has_trend = true;
  drift.slope = tx / tt;
  drift.slope_error = std::sqrt(1.0 / tt);
  drift.freedom = used - 2.0;
  double doubt = 0.0;  // Satterthwaite's: sum of squared shares of the slope's variance over their freedom
  for (const DriftPoint& p : points) {
    if (usable(p)) {
      const double w = 1.0 / (p.standard_error * p.standard_error);
      const double share = w * (t(p) - time) * (t(p) - time) / tt;
      doubt += share * share / p.freedom;
      drift.chi_mean += w * (p.estimate - value) * (p.estimate - value);
      const double z = (p.estimate - value - drift.slope * (t(p) - time)) / p.standard_error;
      drift.chi_square += z * z;
    }
  }
  drift.own_freedom = 1.0 / doubt;
}

// What logs of a parameter differ by, over what their standard errors say, as a ratio of variances.
struct Repeats {
  double ratio = 1.0;
  double freedom = 0.0;  // 0: nothing is known
};

std::map<std::size_t, Repeats> repeats_of(std::span<const ParameterDrift> drift) {
  struct Ratios {
    std::vector<double> line, mean;
    double line_freedom = 0.0, mean_freedom = 0.0;
  };
  std::map<std::size_t, Ratios> ratios;
  for (const ParameterDrift& d : drift) {
    if (!d.has_trend) {
      continue;
    }
    Ratios& r = ratios[d.column];
    if (d.freedom > 0.0) {
      r.line.push_back(d.chi_square / core::chi_squared_median(d.freedom));
      r.line_freedom += d.freedom;
    }
    r.mean.push_back(d.chi_mean / core::chi_squared_median(d.freedom + 1.0));
    r.mean_freedom += d.freedom + 1.0;
  }
  std::map<std::size_t, Repeats> out;
  for (auto& [column, r] : ratios) {
    const bool line = !r.line.empty();
    std::vector<double>& values = line ? r.line : r.mean;
    if (!line && values.size() < fewest_pairs) {
      continue;
    }
    out[column] = {std::max(1.0, core::median(std::move(values))),
                   worth_of_a_median * (line ? r.line_freedom : r.mean_freedom)};
  }
  return out;
}

}  // namespace

std::optional<ParameterDrift> drift_through(std::span<const DriftPoint> points, bool dated) {
  if (points.size() < 2) {
    return std::nullopt;
  }
  ParameterDrift drift;
  drift.dated = dated;
  drift.logs = points.size();
  drift.first = points.front().when;
  drift.last = points.back().when;
  take_certain(drift, points);
  take_line(drift, points, dated ? days_a_week : 1.0);
  return drift;
}

std::vector<ParameterDrift> drift_of(const RobotRecord& record, std::size_t robot, FleetTable& table) {
  std::map<std::size_t, std::vector<DriftPoint>> points;
  const auto take = [&](const LogRecord& log) {
    for (const RecordedParameter& p : log.parameters) {
      constexpr double none = std::numeric_limits<double>::quiet_NaN();
      points[column_of(table, p)].push_back({.when = log.when,
                                             .estimate = p.estimate.value_or(none),
                                             .standard_error = p.standard_error.value_or(none),
                                             .lower = p.lower,
                                             .upper = p.upper,
                                             .freedom = p.freedom.value_or(std::numeric_limits<double>::infinity())});
    }
  };
  take(record.commissioning);
  for (const CheckRecord& check : record.checks) {
    take(check.log);
  }
  std::vector<ParameterDrift> out;
  for (auto& [column, series] : points) {
    std::stable_sort(series.begin(), series.end(), [](const auto& a, const auto& b) { return a.when < b.when; });
    if (auto drift = drift_through(series, record.dated)) {
      drift->robot = robot;
      drift->column = column;
      out.push_back(*drift);
    }
  }
  return out;
}

void judge_drift(std::vector<ParameterDrift>& drift) {
  const std::map<std::size_t, Repeats> repeats = repeats_of(drift);
  std::vector<double> p;
  for (ParameterDrift& d : drift) {
    if (!d.has_trend) {
      continue;
    }
    const auto found = repeats.find(d.column);
    const Repeats known = found == repeats.end() ? Repeats{} : found->second;
    d.slope_error *= std::sqrt(known.ratio);
    const double z = std::abs(d.slope) / d.slope_error;
    const double doubt = 1.0 / d.own_freedom + (known.freedom > 0.0 ? 1.0 / known.freedom : 0.0);
    const double freedom = doubt > 0.0 ? 1.0 / doubt : std::numeric_limits<double>::infinity();
    d.p = 2.0 * core::student_tail(freedom, z);
    const double factor = core::student_quantile_below(freedom, 0.975);
    d.lower = d.slope - factor * d.slope_error;
    d.upper = d.slope + factor * d.slope_error;
    p.push_back(d.p);
  }
  const std::vector<double> adjusted = core::holm(p);
  std::size_t k = 0;
  for (ParameterDrift& d : drift) {
    if (d.has_trend) {
      d.adjusted_p = adjusted[k++];
    }
  }
  const auto size = [](const ParameterDrift& d) { return d.has_trend ? std::abs(d.slope) / d.slope_error : 0.0; };
  std::stable_sort(drift.begin(), drift.end(), [&](const ParameterDrift& a, const ParameterDrift& b) {
    const bool sure_a = a.certain != 0.0, sure_b = b.certain != 0.0;
    if (sure_a != sure_b) {
      return sure_a;
    }
    return a.adjusted_p != b.adjusted_p ? a.adjusted_p < b.adjusted_p : size(a) > size(b);
  });
}

bool repeats_known(std::span<const ParameterDrift> drift) {
  return std::any_of(drift.begin(), drift.end(), [](const auto& d) { return d.has_trend && d.freedom > 0.0; });
}

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

constexpr std::size_t kNamed = 3;  // robots on the first line

std::string spaced_name(const FleetColumn& column) {
  std::string name = column.name;
  std::ranges::replace(name, '_', ' ');
  return name;
}

// "amr_7: coulomb 0.76 N·m, 68 % above the others".
std::string odd_words(const FleetResult& fleet, const RobotOutside& odd) {
  const FleetColumn& column = fleet.table.columns[odd.column];
  const double centre = fleet.population.parameters[odd.column].fit.centre, off = odd.value - centre;
  const std::string where = off > 0.0 ? "above" : "below";
  const std::string by = std::abs(off) < 10.0 * std::abs(centre)
                             ? fmt::format("{:.2g} % {} the others", 100.0 * std::abs(off / centre), where)
                             : fmt::format("{} the others at {:.3g}", where, centre);
  return fmt::format("{}: {} {:.3g}{}, {}", fleet.table.robots[odd.robot], spaced_name(column), odd.value,
                     column.unit == "1" ? "" : " " + column.unit, by);
}

// What is odd, robot by robot: outside first, then drifting, alarmed, failed; odd ones only where there is nothing
// else.
std::vector<std::string> odd_robots(const FleetResult& fleet) {
  std::vector<std::string> out;
  std::set<std::size_t> told;
  const auto tell = [&](std::size_t robot, const auto& text) {
    if (told.insert(robot).second) {
      out.push_back(text());
    }
  };
  for (const RobotOutside& each : fleet.population.outside) {
    tell(each.robot, [&] { return odd_words(fleet, each); });
  }
  for (const ParameterDrift& each : fleet.drift) {
    if (each.drifts(fleet.drift_level)) {
      tell(each.robot, [&] {
        return fmt::format("{}: {} drifts", fleet.table.robots[each.robot],
                           spaced_name(fleet.table.columns[each.column]));
      });
    }
  }
  for (const FleetAlarm& each : fleet.alarms) {
    tell(each.robot, [&] { return fmt::format("{}: alarms in {}", fleet.table.robots[each.robot], each.log); });
  }
  for (const FleetFinding& each : fleet.failed) {
    tell(each.robot, [&] { return fmt::format("{}: no model", fleet.table.robots[each.robot]); });
  }
  for (const RobotOutside& each : fleet.population.odd) {
    tell(each.robot, [&] {
      return fmt::format("{} (by chance in {:.0f} of 100 fleets)", odd_words(fleet, each),
                         std::ceil(100.0 * each.adjusted_p));
    });
  }
  return out;
}

std::string robots(std::size_t n) { return fmt::format("{} robot{}", n, n == 1 ? "" : "s"); }

}  // namespace

double FleetSpread::quantile(double share) const {
  if (values.empty()) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const auto rank =
      static_cast<std::size_t>(std::lround(std::clamp(share, 0.0, 1.0) * static_cast<double>(values.size() - 1)));
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
  if (std::vector<std::string> odd = odd_robots(fleet); !odd.empty()) {
    const std::size_t more = odd.size() > kNamed ? odd.size() - kNamed : 0;
    odd.resize(odd.size() - more);
    out.push_back(
        fmt::format("Look at {}{}.", core::listed(odd, "; "), more == 0 ? "" : fmt::format("; and {} more", more)));
  }
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

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/drift.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <wheelwright/core/statistics.hpp>
#include <wheelwright/study/population.hpp>

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

}  // namespace wheelwright::study

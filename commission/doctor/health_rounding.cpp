// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "commission/doctor/log_health.hpp"
#include "commission/speed_unit.hpp"
#include "core/statistics.hpp"
#include "model/filter/encoder.hpp"

namespace wheelwright::doctor {
namespace {

constexpr double kRpmUnit = 2.0 * std::numbers::pi / 60.0;
constexpr std::size_t kLeastPassages = 8;  // of zero
constexpr double kOffsetErrors = 4.0;

std::string unit_words(double unit) {
  const auto decimal = [](double x) {
    const double scaled = x / std::pow(10.0, std::floor(std::log10(x * 1.001)));
    for (const double d : {1.0, 2.0, 2.5, 5.0}) {
      if (std::abs(scaled / d - 1.0) < 1e-3) {
        return true;
      }
    }
    return false;
  };
  return decimal(unit)              ? fmt::format("{:.4g} rad/s", unit)
         : decimal(unit / kRpmUnit) ? fmt::format("{:.3g} rpm ({:.4g} rad/s)", unit / kRpmUnit, unit)
                                    : fmt::format("{:.4g} rad/s", unit);
}

// How far, in units, logged speeds lie below (towards zero) and beside (downwards) what is true: with standard errors.
struct Offset {
  double inwards = 0.0, inwards_error = 0.0, down = 0.0, down_error = 0.0;
};

// Against the angles beside them: by blocks of a second.
std::optional<Offset> against_angles(const HealthView& view, const JointView& joint, double unit) {
  if (joint.angle == nullptr || joint.speed == nullptr) {
    return std::nullopt;
  }
  const std::vector<double>&t = view.log->t, &angle = *joint.angle, &speed = *joint.speed;
  std::vector<double> inwards, down;
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first; k + 1 < last;) {
      std::size_t end = k;
      double sum = 0.0, of_sign = 0.0;
      while (end + 1 < last && t[end] - t[k] < 1.0) {
        sum += 0.5 * (speed[end] + speed[end + 1]) * (t[end + 1] - t[end]);
        of_sign += (std::abs(speed[end]) > 0.5 * unit ? std::copysign(1.0, speed[end]) : 0.0) * (t[end + 1] - t[end]);
        ++end;
      }
      const double seconds = t[end] - t[k];
      if (seconds > 0.5) {
        const double lacks = (angle[end] - angle[k] - sum) / seconds / unit, sign = of_sign / seconds;
        if (std::abs(sign) > 0.9) {
          inwards.push_back(lacks * sign);
          down.push_back(lacks);
        }
      }
      k = std::max(end, k + 1);
    }
  }
  if (inwards.size() < kLeastPassages) {
    return std::nullopt;
  }
  const auto mean = [](const std::vector<double>& x, double& error) {
    double m = 0.0, s = 0.0;
    for (const double v : x) {
      m += v / static_cast<double>(x.size());
    }
    for (const double v : x) {
      s += (v - m) * (v - m);
    }
    error = std::sqrt(s / static_cast<double>(x.size() * (x.size() - 1)));
    return m;
  };
  Offset o;
  o.inwards = mean(inwards, o.inwards_error);
  o.down = mean(down, o.down_error);
  return o;
}

// Rows at 0 over those at one unit to both sides, where a speed passes through all three: 1 where speeds are rounded or
// cut off downwards, 2 where they are cut off towards zero.
struct Passages {
  std::size_t count = 0;
  double ratio = 0.0, error = 0.0;
};
Passages passages_of(const HealthView& view, const std::vector<double>& speed, double unit) {
  std::vector<double> ratios;
  for (const auto& [first, last] : view.segments) {
    std::vector<std::pair<long, double>> runs;  // counts, rows
    for (std::size_t k = first; k < last; ++k) {
      const long n = std::lround(speed[k] / unit);
      if (runs.empty() || runs.back().first != n) {
        runs.emplace_back(n, 0.0);
      }
      runs.back().second += 1.0;
    }
    for (std::size_t r = 2; r + 2 < runs.size(); ++r) {
      const long before = runs[r - 1].first, after = runs[r + 1].first;
      if (runs[r].first == 0 && before * after == -1 && runs[r - 2].first == 2 * before &&
          runs[r + 2].first == 2 * after) {
        ratios.push_back(2.0 * runs[r].second / (runs[r - 1].second + runs[r + 1].second));
      }
    }
  }
  Passages p{.count = ratios.size()};
  if (p.count < kLeastPassages) {
    return p;
  }
  double sum = 0.0, squares = 0.0;
  for (const double r : ratios) {
    sum += r;
    squares += r * r;
  }
  const auto n = static_cast<double>(p.count);
  p.ratio = sum / n;
  p.error = std::sqrt(std::max(0.0, squares / n - p.ratio * p.ratio) / n);
  return p;
}

enum class Cut { unknown, rounded, not_inwards, towards_zero, down };

Cut kind_of(const HealthView& view, const JointView& joint, double unit) {
  if (const auto o = against_angles(view, joint, unit)) {
    const auto is = [](double value, double error, double expected) {
      return std::abs(value - expected) < std::max(0.1, 2.0 * error) && kOffsetErrors * error < 0.4;
    };
    // Of a drive in one direction both offsets are alike, and so is what is given back.
    return is(o->down, o->down_error, 0.5)                                            ? Cut::down
           : is(o->inwards, o->inwards_error, 0.5)                                    ? Cut::towards_zero
           : is(o->inwards, o->inwards_error, 0.0) && is(o->down, o->down_error, 0.0) ? Cut::rounded
                                                                                      : Cut::unknown;
  }
  // Simulated drives with and without dry friction, which holds a speed at zero: 0.9 to 1.3 and 1.9 to 2.5.
  const Passages p = passages_of(view, *joint.speed, unit);
  const double doubt = kOffsetErrors * p.error;
  return p.count < kLeastPassages                   ? Cut::unknown
         : p.ratio - doubt > 1.45 && p.ratio < 2.75 ? Cut::towards_zero
         : p.ratio + doubt < 1.65 && p.ratio > 0.75 ? Cut::not_inwards
                                                    : Cut::unknown;
}

// Speeds in whole numbers that nothing else in the log measures: no driver rounds rad/s so, and they may be rpm.
bool tell_whole_numbers(const HealthView& view, const JointView& joint, double unit,
                        std::vector<LogFinding>& findings) {
  const auto& declared = view.robot.noise.wheel_speed.value;
  const bool whole = unit >= 1.0 && std::abs(unit - std::round(unit)) < 1e-9;
  if (!whole || !view.robot_given || !model::on_two_wheels(view.robot) || declared.value_or(0.0) >= 0.499 * unit ||
      joint.angle != nullptr || view.column("gyro_z") != nullptr || view.column("theta") != nullptr) {
    return false;
  }
  const std::vector<std::string> columns = motion_columns(view);
  findings.push_back(
      {.id = "units.wheel_speed",
       .topic = FindingTopic::units,
       .severity = FindingSeverity::fatal,
       .sentence =
           fmt::format("{} has whole numbers only, up to {:.4g}: as rpm, deg/s or mm/s are logged, and rad/s are "
                       "not; and the log has neither angles nor gyro nor pose to tell.",
                       joint.speed_name, joint.top),
       .next = fmt::format("Say what they are: of rpm {}, of deg/s {}, of mm/s at the rim {}; where they are rad/s, "
                           "`noise: {{wheel_speed: {:.4g}}}` in the robot file says so.",
                           scaling_arguments(view, columns, std::numbers::pi / 30.0),
                           scaling_arguments(view, columns, std::numbers::pi / 180.0),
                           scaling_arguments(view, columns, 1e-3 / view.robot.wheel_radius), unit),
       .columns = {joint.speed_name},
       .value = unit,
       .unit = "rad/s"});
  return true;
}

}  // namespace

void check_rounding(const HealthView& view, std::vector<LogFinding>& findings) {
  if (!(view.step > 0.0)) {
    return;
  }
  for (const JointView& joint : view.joints) {
    if (joint.speed == nullptr || !(joint.top > 0.0) || view.robot.speed_cut) {
      continue;
    }
    const double unit = commission::unit_of_speeds(*joint.speed, joint.top);
    if (tell_whole_numbers(view, joint, unit, findings)) {
      return;
    }
    if (!(unit > commission::kCoarseUnit * joint.top) || filter::find_encoder(*joint.speed, view.step)) {
      continue;
    }
    if (view.robot.noise.wheel_speed.value.value_or(0.0) > 0.999 * unit) {
      continue;  // declared for the worst of it
    }
    const Cut cut = kind_of(view, joint, unit);
    const bool cut_off = cut == Cut::towards_zero || cut == Cut::down;
    const std::string at_most =
        fmt::format("`noise: {{wheel_speed: {:.4g}}}`", cut == Cut::rounded || cut == Cut::down ? 0.5 * unit : unit);
    LogFinding f{.id = "signals.rounded",
                 .topic = FindingTopic::signals,
                 .severity = cut_off || cut == Cut::unknown ? FindingSeverity::warning : FindingSeverity::notice,
                 .columns = {joint.speed_name},
                 .value = unit,
                 .unit = "rad/s"};
    f.sentence = fmt::format(
        "{} is in whole multiples of {}, {:.2g} % of the top speed: {}.", joint.speed_name, unit_words(unit),
        100.0 * unit / joint.top,
        cut == Cut::rounded ? "rounded, wrong by half of that at most"
        : cut == Cut::not_inwards
            ? "rounded, or cut off downwards: wrong by half of that at most, or too low by half of "
              "it on average"
        : cut == Cut::towards_zero ? "cut off towards zero, and so too small by half of that on average"
        : cut == Cut::down         ? "cut off downwards, and so too low by half of that on average"
                           : "rounded, or cut off and so wrong by up to the whole of it to one side, which this "
                             "log does not tell");
    if (cut_off) {
      f.speed_cut = model::SpeedCut{.unit = unit, .down = cut == Cut::down};
      f.next = fmt::format(
          "Half a unit is given back. `speed_cut: {{unit: {:.8g}, towards: {}}}` and {} in the robot "
          "file say so; best, log angles, or speeds with their full resolution.",
          unit, cut == Cut::down ? "below" : "zero", at_most);
    } else {
      f.next = fmt::format("Write {} into the robot file{}; best, log angles, or speeds with their full resolution.",
                           at_most,
                           cut == Cut::rounded || cut == Cut::not_inwards
                               ? ""
                               : fmt::format(", and `speed_cut: {{unit: {:.8g}, towards: zero}}` where "
                                             "the driver cuts off (a cast to int does)",
                                             unit));
    }
    findings.push_back(std::move(f));
  }
}

}  // namespace wheelwright::doctor

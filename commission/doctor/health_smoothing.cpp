// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "commission/contradictions.hpp"
#include "commission/doctor/log_health.hpp"
#include "commission/fit.hpp"
#include "commission/setting.hpp"
#include "commission/speed_smoothing.hpp"

namespace wheelwright::doctor {
namespace {

constexpr double kAlikeParameters = 0.005;  // share by which a delay and a filter, not told apart, may move parameters

std::string as_sentence(std::string text) {
  text.front() =
      static_cast<char>(text.front() >= 'a' && text.front() <= 'z' ? text.front() - 'a' + 'A' : text.front());
  return text + ".";
}

// s, time before which what a filter of the speeds makes of the efforts hardly depends on them: 5 % of exponential
// ones. Rounded outward, for people to copy.
double memory_of(const commission::SpeedSmoothing& smoothing, double step) {
  constexpr double kPerSecond = 1e4, kOfExponential = 3.0;
  const bool mean = smoothing.told && smoothing.filter.kind == model::SpeedFilterKind::mean;
  const double time = mean ? smoothing.filter.time.upper : kOfExponential * smoothing.delay + step;
  return std::ceil(kPerSecond * time) / kPerSecond;
}

}  // namespace

bool check_smoothing(const HealthView& view, LogSource& log, const commission::Setting& s, const commission::Fit& fit,
                     const commission::EffortTiming& timing, bool refused, std::vector<LogFinding>& findings) {
  const auto smoothing = commission::smoothing_behind(log, s, fit, timing);
  if (!smoothing) {
    return false;
  }
  LogFinding f{.id = "signals.speed_filter",
               .topic = FindingTopic::signals,
               .severity = refused ? FindingSeverity::fatal : FindingSeverity::warning,
               .columns = s.measurement.motion_columns,
               .value = smoothing->time,
               .unit = "s"};
  f.sentence = as_sentence(commission::late_speeds(*smoothing));
  f.next = as_sentence(commission::way_out(*smoothing));
  const bool plain = s.measurement.delay == Interval{} && !smoothing->dry_friction &&
                     (smoothing->told || smoothing->differs < kAlikeParameters);
  Robot filtered = view.robot;
  filtered.speed_filter = smoothing->filter;
  const OtherReading left = plain ? read_as(log, filtered) : OtherReading{false, false};
  if (left.explained && left.in_time) {
    f.severity = FindingSeverity::warning;
    f.speed_filter = smoothing->filter;
    f.next = fmt::format(
        "Every command passes the efforts through `{}`{}, and calls nothing guaranteed. Write that into the robot "
        "file, with what is known of the driver's filter; best, log angles or speeds that are not smoothed.",
        commission::declaration(smoothing->filter), smoothing->told ? "" : ", which stands between all of these");
  }
  if (!f.speed_filter && view.robot_given && s.measurement.delay == Interval{}) {
    Robot early = view.robot;
    early.effort_delay = {-memory_of(*smoothing, view.step), 0.0};
    if (const OtherReading with_it = read_as(log, early); with_it.explained && with_it.in_time) {
      f.severity = FindingSeverity::warning;
      f.taken = early.effort_delay;
      f.next = fmt::format(
          "Commands take the efforts for early by anything up to {:g} s, in which all lies that such a filter makes of "
          "them: bounds widen by what the efforts change in that time, and none is called guaranteed. For narrower "
          "ones, {}.",
          -f.taken->lower, commission::way_out(*smoothing));
    }
  }
  findings.push_back(std::move(f));
  return true;
}

}  // namespace wheelwright::doctor

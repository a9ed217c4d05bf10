// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "commission/commission.hpp"
#include "commission/contradiction_search.hpp"
#include "commission/contradictions.hpp"
#include "commission/doctor/log_health.hpp"
#include "commission/effort_smoothing.hpp"
#include "commission/fit.hpp"
#include "commission/setting.hpp"
#include "core/words.hpp"

namespace wheelwright::doctor {
namespace {

using commission::EffortTiming;
using commission::Fit;
using commission::Setting;

constexpr double kLongestTaken = 0.1;      // s: efforts later than this and than kMostStepsTaken are refused
constexpr double kLongestSmoothing = 0.1;  // s, likewise
constexpr double kMostStepsTaken = 4.5;    // four, and the half to which interpolated rows tell a shift
constexpr double kTakenFrom = 0.5;         // of the least shift that is a latency
constexpr double kLateFrom = 0.15;         // steps: healthy logs showed 0.09 at most
constexpr double kFilterRisk = 1e-4;       // of an interval of κ that misses
constexpr double kNoisyEffort = 0.1;       // of κ: noise of the efforts makes it look smaller
constexpr double kLeastSharpening = 0.03;  // κ, steps
constexpr double kMostSharpening = 0.7;    // more may be a step of delay
constexpr double kMovedBySmoothing = 2.0;  // standard errors of a parameter

// What was found of efforts and motion in time, and what declared errors make of it.
struct Timing {
  std::optional<EffortTiming> shift;
  commission::WithinDeclared declared;
  bool told = false;    // commissioning makes no model of it
  bool likely = false;  // it takes the word guaranteed away at least

  [[nodiscard]] bool refuses() const { return !declared.a_set || told; }
};

Timing timing_of(const HealthView& view, LogSource& log, const Setting& s, const Fit& fit) {
  Timing timing;
  timing.shift = commission::effort_timing(log, s, fit);
  const bool declared = view.robot_given && s.noise_complete;
  if (declared) {
    timing.declared = commission::within_declared(log, s, fit, timing.shift);
  }
  if (!timing.shift) {
    return timing;
  }
  using commission::ShiftWeight;
  const bool latency = commission::is_latency(*timing.shift, view.step);
  if (!declared) {
    timing.told = timing.likely = latency;
  } else if (timing.declared.a_set) {
    timing.told = timing.declared.shift == ShiftWeight::told;
    timing.likely = timing.declared.shift != ShiftWeight::explained;
  } else {
    timing.likely = latency || commission::looks_shifted(*timing.shift, view.step);
  }
  return timing;
}

void tell_unexplained(const HealthView& view, LogSource& log, std::string_view even_so, std::vector<LogFinding>& out) {
  const bool halves = view.robot_given && commission::halves_are_explained(log, view.robot);
  out.push_back(
      {.id = "motion.refused",
       .topic = FindingTopic::motion,
       .severity = FindingSeverity::fatal,
       .sentence =
           fmt::format("Commissioning refuses the log: {}no parameters explain it within its declared noise{}{}.",
                       even_so, halves ? "; " : "", halves ? commission::kOnlyInHalves : ""),
       .next = halves ? core::capital(std::string(commission::kWhatChanged)) + "."
                      : "Look for a fault, for an effect that the model lacks (`gap`), and whether the bounds "
                        "under `noise:` are too small; `wheelwright commission` says by how much they would "
                        "have to be larger."});
}

// κ of a filter of the efforts at a risk of kFilterRisk.
Interval sharpening_range(const commission::EffortSmoothing& found) {
  const double reach = commission::errors_at(kFilterRisk, found.freedom) * found.standard_error +
                       kNoisyEffort * std::abs(found.sharpening);
  return {found.sharpening - reach, found.sharpening + reach};
}

// Outward to 10 µs.
Interval rounded_time(double lower, double upper) {
  return {std::floor(1e5 * lower) / 1e5, std::ceil(1e5 * upper) / 1e5};
}

// Efforts that are no commands as they acted, but those behind a low-pass filter. Held commands that act from their
// stamps on are late by whole steps: what is late by less is smoothed.
bool check_effort_filter(const HealthView& view, LogSource& log, const Setting& s, const Fit& fit,
                         std::vector<LogFinding>& out) {
  const bool at_stamps =
      s.measurement.hold == Hold::zero_order && s.measurement.changes == model::EffortChanges::at_samples;
  const bool declares = s.measurement.delay != Interval{} || s.measurement.smoothing != Interval{};
  if (!view.robot_given || !at_stamps || declares || !view.robot.effects.empty()) {
    return false;
  }
  const auto found = commission::effort_smoothing(log, s, fit);
  if (!found) {
    return false;
  }
  const Interval sharpening = sharpening_range(*found);
  if (sharpening.lower < kLeastSharpening || sharpening.upper > kMostSharpening || found->moved < kMovedBySmoothing) {
    return false;
  }
  const auto time = [&](double kappa) { return commission::EffortSmoothing::time_constant(kappa, view.step); };
  const Interval range = rounded_time(time(sharpening.lower), time(sharpening.upper));
  LogFinding f{.id = "signals.effort_filter",
               .topic = FindingTopic::signals,
               .severity = FindingSeverity::warning,
               .columns = s.measurement.effort_columns,
               .value = time(found->sharpening),
               .unit = "s",
               .effort_smoothing = range};
  f.sentence = fmt::format(
      "The efforts are smoothed: a low-pass filter with a time constant of {:.2g} to {:.2g} ms explains why they come "
      "{:.2g} ± {:.1g} steps after the motion (95 %), which commands that are held from stamp to stamp do not. Every "
      "command undoes it, and calls nothing guaranteed.",
      1e3 * range.lower, 1e3 * range.upper, found->sharpening, 2.0 * found->standard_error);
  f.next = fmt::format(
      "`effort: {{smoothing: [{:g}, {:g}]}}` in the robot file declares it, with what is known of the filter; best, "
      "log the efforts that are not smoothed.",
      range.lower, range.upper);
  out.push_back(std::move(f));
  Robot robot = view.robot;
  robot.effort_smoothing = range;
  if (s.noise_complete && !read_as(log, robot).explained) {
    tell_unexplained(view, log, "even with its efforts so read, ", out);
  }
  return true;
}

// What late efforts are taken for: a delay, a filter, or, where the log does not tell, anything from one to the other.
struct TakenLag {
  Interval delay;                     // s
  std::optional<Interval> smoothing;  // s, time constant

  [[nodiscard]] std::string words() const {
    return fmt::format(
        "a delay of {:g} to {:g} s{}", delay.lower, delay.upper,
        smoothing ? fmt::format(" behind a low-pass filter of {:g} to {:g} s", smoothing->lower, smoothing->upper)
                  : "");
  }
  [[nodiscard]] std::string keys() const {
    return fmt::format("delay: [{:g}, {:g}]{}", delay.lower, delay.upper,
                       smoothing ? fmt::format(", smoothing: [{:g}, {:g}]", smoothing->lower, smoothing->upper) : "");
  }
};

// `range`: of the delay, if it is one. A filter that runs faster than the log is later by up to a step than one that
// runs with it.
TakenLag lag_of_efforts(const HealthView& view, LogSource& log, const Setting& s, const Fit& fit, double delay,
                        const Interval& range) {
  const commission::EffortLag told = commission::effort_lag(log, s, fit, delay);
  TakenLag lag{range, std::nullopt};
  const auto found = told == commission::EffortLag::delay ? std::nullopt : commission::effort_smoothing(log, s, fit);
  if (found && found->sharpening > 0.0) {
    const Interval sharpening = sharpening_range(*found);
    const bool filter = told == commission::EffortLag::filter;
    lag.smoothing = rounded_time(filter ? std::max(0.0, sharpening.lower * view.step) : 0.0,
                                 commission::EffortSmoothing::time_constant(sharpening.upper, view.step));
    lag.delay = {0.0, filter ? view.step : range.upper};
  }
  return lag;
}

// Efforts that are late, where the robot file leaves that open: what commands take them for.
std::optional<TakenLag> find_lag(const HealthView& view, LogSource& log, const Setting& s, const Fit& fit,
                                 const Timing& timing) {
  const EffortTiming& shift = *timing.shift;
  const double delay = shift.delay, error = shift.standard_error;
  const bool late = s.noise_complete
                        ? timing.likely || commission::is_latency(shift, kTakenFrom * view.step)
                        : shift.beyond() > std::max(4.0 * error, kLateFrom * view.step) && shift.mirror_ratio > 1.001 &&
                              (shift.residual_ratio < 0.99 || shift.moved > 2.0);
  if (!view.robot_given || !(delay > 0.0) || s.measurement.delay != Interval{} ||
      s.measurement.smoothing != Interval{} || !view.robot.effects.empty() || !late) {
    return std::nullopt;
  }
  const double about = 5.0 * error + 0.5 * view.step;  // interpolated rows tell a shift to half a step
  // Commands that change between samples may act up to a step before their stamps, beside any delay.
  const bool between = s.measurement.hold == Hold::zero_order && s.measurement.changes == model::EffortChanges::between;
  const double upper = delay + about - (between ? view.step : 0.0);
  const Interval range{std::floor(1e4 * (delay - about)) / 1e4, std::ceil(1e4 * upper) / 1e4};
  return lag_of_efforts(view, log, s, fit, delay, range);
}

Robot with(Robot robot, const TakenLag& lag) {
  robot.effort_delay = lag.delay;
  robot.effort_smoothing = lag.smoothing.value_or(Interval{});
  return robot;
}

bool is_taken(const HealthView& view, const std::optional<TakenLag>& lag) {
  const double most = kMostStepsTaken * view.step;
  return lag && lag->delay.upper <= std::max(kLongestTaken, most) &&
         lag->smoothing.value_or(Interval{}).upper <= std::max(kLongestSmoothing, most);
}

// The delays that commissioning takes in, where it makes a model of efforts that come before the motion.
std::optional<Interval> taken_as_open(LogSource& log, const Robot& robot) {
  commission::CommissionOptions options;
  options.at_risk = commission::CommissionOptions::AtRisk::nothing;
  const commission::Commissioning result = commission::commission_robot(log, robot, options);
  log.rewind();
  return result.has_model() ? std::optional(result.model.robot.effort_delay) : std::nullopt;
}

// What a shift asks for.
std::string advice(const Setting& s, double steps, bool matters, bool large) {
  if (matters && s.measurement.hold == Hold::first_order && std::abs(steps + 0.5) < 0.2) {
    return "That is half a step: the efforts look like commands that are held. Set effort.hold to zero_order in the "
           "robot file.";
  }
  if (matters && s.measurement.hold == Hold::zero_order && std::abs(steps - 0.5) < 0.2) {
    return "That is half a step: the efforts look measured. Set effort.hold to first_order in the robot file.";
  }
  return large     ? "Stamp both with one clock where they are measured; where they are, the actuator or a sensor is "
                     "slow: `wheelwright gap` tells them apart."
         : matters ? "It is less than a step: `effort.hold` in the robot file counts for half of one."
                   : "";
}

std::string shift_in_words(const Setting& s, const EffortTiming& shift, bool matters) {
  const double delay = shift.delay, left = 100.0 * shift.residual_ratio;
  const char* side = delay > 0.0 ? "after" : "before";
  if (s.measurement.delay != Interval{} && shift.beyond() == 0.0) {
    return fmt::format("The effort comes {:.2g} ± {:.1g} s {} the motion (95 %), as the robot file allows.",
                       std::abs(delay), 2.0 * shift.standard_error, side);
  }
  return matters ? fmt::format(
                       "The effort comes {:.2g} ± {:.1g} s {} the motion (95 %); shifted by that, {:.0f} % of the "
                       "residual are left.",
                       std::abs(delay), 2.0 * shift.standard_error, side, left)
                 : fmt::format(
                       "No shift in time between effort and motion explains the log better: the best, {:.2g} s, "
                       "leaves {:.0f} % of the residual.",
                       delay, left);
}

}  // namespace

OtherReading read_as(LogSource& log, const Robot& robot) {
  constexpr double kUnusedRisk = 1e-3;
  log.rewind();
  const Setting s = commission::settle(log, robot);
  const Fit fit = commission::fit_log(log, s, commission::Part::everything, kUnusedRisk);
  const auto shift = commission::effort_timing(log, s, fit);
  return {.explained = !s.noise_complete || commission::within_declared(log, s, fit, std::nullopt).a_set,
          .in_time = !shift || !commission::is_latency(*shift, s.survey.median_step)};
}

void check_delay(const HealthView& view, LogSource& log, const Setting& s, const Fit& fit,
                 std::vector<LogFinding>& out) {
  const Timing timing = timing_of(view, log, s, fit);
  const std::optional<EffortTiming>& shift = timing.shift;
  if (shift && shift->delay > -kLateFrom * view.step && check_effort_filter(view, log, s, fit, out)) {
    return;
  }
  if (shift && shift->delay < 0.0 && timing.likely &&
      check_smoothing(view, log, s, fit, *shift, timing.refuses(), out)) {
    return;
  }
  if (!shift) {
    if (timing.refuses()) {
      tell_unexplained(view, log, "", out);
    }
    return;
  }
  const double delay = shift->delay, steps = delay / view.step;
  std::optional<TakenLag> lag = find_lag(view, log, s, fit, timing);
  const bool tried = is_taken(view, lag);
  bool taken = tried && (!s.noise_complete || read_as(log, with(view.robot, *lag)).explained);
  if (view.robot_given && timing.told && delay < 0.0 && !taken) {
    if (const auto open = taken_as_open(log, view.robot)) {
      lag = TakenLag{*open, std::nullopt};
      taken = true;
    }
  }
  const bool matters = timing.likely || (std::abs(delay) > 3.0 * shift->standard_error &&
                                         shift->residual_ratio < 0.95 && std::abs(steps) > 0.25);
  const bool large = matters && std::abs(steps) > 0.75;
  const bool blamed = timing.told || (!timing.declared.a_set && timing.likely && !tried);
  const bool refused = view.robot_given && blamed && !taken;
  LogFinding f{.id = "time.effort_delay",
               .topic = FindingTopic::time,
               .severity = refused                                                 ? FindingSeverity::fatal
                           : large || (view.robot_given && timing.likely) || taken ? FindingSeverity::warning
                           : matters                                               ? FindingSeverity::notice
                                                                                   : FindingSeverity::fine};
  f.columns = s.measurement.effort_columns;
  f.value = delay;
  f.unit = std::string("s");
  f.sentence = shift_in_words(s, *shift, matters || taken);
  f.next = advice(s, steps, matters, large);
  if (taken) {
    f.taken = lag->delay;
    f.effort_smoothing = lag->smoothing;
    f.sentence += fmt::format(
        " Commands take it for {}: bounds widen by what the efforts change in that time and a step, and none is called "
        "guaranteed.",
        lag->words());
    f.next = fmt::format("`effort: {{{}}}` in the robot file declares it. {}", lag->keys(), f.next);
  } else if (lag && lag->smoothing) {
    f.sentence += fmt::format(" Efforts with {} look like that.", lag->words());
  }
  out.push_back(f);
  if (!timing.declared.a_set && !taken && !refused) {
    tell_unexplained(view, log, tried ? "even with its efforts so late, " : "", out);
  }
}

}  // namespace wheelwright::doctor

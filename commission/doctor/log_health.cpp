// SPDX-License-Identifier: Apache-2.0
#include "commission/doctor/log_health.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <set>

#include <fmt/format.h>

#include "commission/doctor/health_efforts.hpp"
#include "core/check.hpp"
#include "core/even_clock.hpp"
#include "core/for_all.hpp"
#include "core/statistics.hpp"
#include "core/words.hpp"

namespace wheelwright::doctor {
namespace {

constexpr double kGap = 5.0;      // median steps from which on the readers begin a segment
constexpr double kMissing = 1.5;  // median steps from which on a sample is missing

LogFinding about_time(const char* id, FindingSeverity severity, std::string sentence, std::string next, double value,
                      const char* unit) {
  return {.id = id,
          .topic = FindingTopic::time,
          .severity = severity,
          .sentence = std::move(sentence),
          .next = std::move(next),
          .value = value,
          .unit = unit};
}

FindingSeverity graded(double value, double notice, double warning) {
  return value > warning ? FindingSeverity::warning : value > notice ? FindingSeverity::notice : FindingSeverity::fine;
}

// Steps inside segments, each with the row that it ends at.
struct Steps {
  std::vector<double> length;
  std::vector<std::size_t> row;
};

Steps steps_of(const HealthView& view) {
  Steps steps;
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first + 1; k < last; ++k) {
      steps.length.push_back(view.log->t[k] - view.log->t[k - 1]);
      steps.row.push_back(k);
    }
  }
  return steps;
}

// The largest decimal quantum of which all steps are multiples; 0 where there is none.
double decimal_quantum(const std::vector<double>& steps, double median) {
  for (double decade = std::pow(10.0, std::floor(std::log10(median))); decade > 1e-7; decade /= 10.0) {
    for (const double q : {5.0 * decade, 2.0 * decade, decade}) {
      if (q <= median * 1.0001 &&
          std::ranges::all_of(steps, [&](double h) { return std::abs(h / q - std::round(h / q)) < 1e-3; })) {
        return q;
      }
    }
  }
  return 0.0;
}

constexpr double kShortestStep = 2.5e-4;      // s, of a robot on wheels: a driver logs it at 4 kHz at most
constexpr double kShortestAxisStep = 2e-5;    // s, of a single axis, which a test stand may log much faster
constexpr double kSerialDays[] = {3e4, 6e4};  // days since 1900, from 1982 on

// Units that `step` of them, the first at `first`, may be of, each with the rate that it makes; empty where s are
// plausible. Of units shorter than s the first, of longer ones all that make a robot's log of it: nothing but the rate
// tells min from h and days.
std::vector<std::string> time_units(double step, double first, double shortest) {
  if (step >= 1.0) {
    for (const auto& [factor, unit] : {std::pair{1e-3, "ms"}, std::pair{1e-6, "µs"}, std::pair{1e-9, "ns"}}) {
      if (step * factor >= 2e-4 && step * factor < 0.3) {
        return {unit};
      }
    }
    return {};
  }
  std::vector<std::string> units;
  const bool serial = first > kSerialDays[0] && first < kSerialDays[1];
  if (step > 0.0 && step < shortest) {
    for (const auto& [factor, unit] : {std::pair{60.0, "min"}, std::pair{3600.0, "h"}, std::pair{86400.0, "days"}}) {
      if (step * factor >= 1e-3 && step * factor <= 0.2 && (!serial || factor > 3600.0)) {
        units.push_back(fmt::format("{} ({:.3g} Hz)", unit, 1.0 / (step * factor)));
      }
    }
    if (units.empty()) {
      units.emplace_back("another unit");
    }
  }
  return units;
}

void check_rate(const HealthView& view, const ReaderCounts& reader, double seconds, std::vector<LogFinding>& out) {
  const double rate = view.step > 0.0 ? 1.0 / view.step : 0.0;
  const std::vector<std::string> units =
      time_units(view.step, view.log->t.empty() ? 0.0 : view.log->t.front(),
                 model::on_two_wheels(view.robot) ? kShortestStep : kShortestAxisStep);
  if (!units.empty() && std::ranges::find(out, std::string("time.bursts"), &LogFinding::id) == out.end()) {
    out.push_back(about_time("units.time", FindingSeverity::fatal,
                             fmt::format("The median step is {:.4g} s: the time stamps look like {}, not s.", view.step,
                                         core::listed(units, " or ")),
                             reader.time_remedy.empty()
                                 ? "Convert the column t to seconds: --map t=\"*FACTOR\" does so."
                                 : fmt::format("Make seconds of the column t: {} does so.", reader.time_remedy),
                             view.step, "s"));
    out.back().topic = FindingTopic::units;
    return;
  }
  const FindingSeverity severity = rate < 10.0   ? FindingSeverity::warning
                                   : rate < 40.0 ? FindingSeverity::notice
                                                 : FindingSeverity::fine;
  out.push_back(about_time("time.rate", severity,
                           fmt::format("{} rows at {:.4g} Hz: {:.4g} s of driving in {} segment{}.", view.log->rows(),
                                       rate, seconds, view.segments.size(), view.segments.size() == 1 ? "" : "s"),
                           severity == FindingSeverity::fine
                               ? ""
                               : "Log at 50 Hz or more: what happens between two rows must be interpolated, and that "
                                 "widens every bound.",
                           rate, "Hz"));
}

void check_length(const HealthView& view, double seconds, std::vector<LogFinding>& out) {
  const std::size_t rows = view.log->rows();
  if (rows < 50) {
    out.push_back(about_time("time.length", FindingSeverity::fatal,
                             fmt::format("{} rows are left: nothing can be fitted to fewer than 50.", rows),
                             "Record a minute of driving.", seconds, "s"));
  } else if (seconds < 30.0) {
    out.push_back(about_time("time.length", seconds < 10.0 ? FindingSeverity::warning : FindingSeverity::notice,
                             fmt::format("{:.3g} s of driving is little to learn from and to hold some of it back for "
                                         "validation.",
                                         seconds),
                             "Drive for a minute or more, or give several logs together.", seconds, "s"));
  }
}

void check_segments(const HealthView& view, double seconds, std::vector<LogFinding>& out) {
  const std::vector<double>& t = view.log->t;
  LogFinding gaps = about_time("time.gaps", FindingSeverity::notice, "", "", 0.0, "s");
  std::size_t resets = 0;
  double lost = 0.0;
  for (std::size_t s = 1; s < view.segments.size(); ++s) {
    const double before = t[view.segments[s].first - 1], after = t[view.segments[s].first];
    if (after <= before) {
      ++resets;
      continue;
    }
    if (after - before <= kGap * view.step) {  // the rows of another file, or of a wheel angle that was set back
      continue;
    }
    lost += after - before;
    if (++gaps.stretches <= kMostStretches) {
      gaps.when.push_back({before, after});
    }
  }
  if (gaps.stretches > 0) {
    const double mean = seconds / static_cast<double>(view.segments.size());
    const double share = lost / (lost + seconds);
    gaps.value = lost;
    gaps.severity = share > 0.1 || mean < 5.0 ? FindingSeverity::warning : FindingSeverity::notice;
    gaps.sentence = fmt::format(
        "{} gap{} of together {:.3g} s ({:.2g} % of the time); segments last {:.3g} s on "
        "average.",
        gaps.stretches, gaps.stretches == 1 ? "" : "s", lost, 100.0 * share, mean);
    gaps.next =
        "Nothing is filtered across a gap, and each segment loses its beginning while the filter settles: look "
        "for a recorder that stalls, or for logs cut apart on purpose.";
    out.push_back(gaps);
  }
  if (resets > 0) {
    out.push_back(about_time("time.resets", FindingSeverity::notice,
                             fmt::format("Time goes back {} time{}: several recordings in one log, or a clock that was "
                                         "set.",
                                         resets, resets == 1 ? "" : "s"),
                             "Fine where recordings were joined; otherwise stamp with a monotonic clock.",
                             static_cast<double>(resets), "1"));
  }
}

void check_reader(const ReaderCounts& reader, std::vector<LogFinding>& out) {
  const double read = static_cast<double>(std::max<std::size_t>(reader.rows_read, 1));
  const auto tell = [&](const char* id, std::size_t count, const char* what, const char* next) {
    if (count > 0) {
      const double share = static_cast<double>(count) / read;
      out.push_back(about_time(id, share > 0.01 ? FindingSeverity::warning : FindingSeverity::notice,
                               fmt::format("{} of {} rows were dropped: {}.", count, reader.rows_read, what), next,
                               share, "1"));
    }
  };
  tell(
      "time.incomplete_rows", reader.incomplete, "a field that is used is empty, NaN or infinite",
      "See which sensor leaves fields empty; topics of different rates have to be brought together first (`convert`).");
  tell("time.duplicates", reader.duplicates, "the same time as the row before",
       "Log more decimals of time, and each message once.");
  tell("time.cut_off", reader.truncated, "the last line is cut off", "The recorder was stopped while it wrote.");
}

void check_steps(const HealthView& view, std::vector<LogFinding>& out) {
  const Steps steps = steps_of(view);
  if (steps.length.size() < 10) {
    return;
  }
  const double median = view.step;
  std::vector<bool> late(view.log->rows(), false);
  std::size_t missing = 0;
  double squares = 0.0, n = 0.0;
  for (std::size_t i = 0; i < steps.length.size(); ++i) {
    if (steps.length[i] > kMissing * median) {
      late[steps.row[i]] = late[steps.row[i] - 1] = true;
      missing += static_cast<std::size_t>(std::max(1.0, std::round(steps.length[i] / median) - 1.0));
    } else {
      squares += (steps.length[i] - median) * (steps.length[i] - median);
      n += 1.0;
    }
  }
  const double jitter = n > 0.0 ? std::sqrt(std::max(0.0, squares / n)) / median : 0.0;
  if (missing > 0) {
    const double share = static_cast<double>(missing) / static_cast<double>(view.log->rows() + missing);
    LogFinding f = about_time("time.missing_samples", graded(share, 0.0, 0.01),
                              fmt::format("About {} samples are missing between rows ({:.2g} %): steps longer than "
                                          "{:.3g} s.",
                                          missing, 100.0 * share, kMissing * median),
                              "What happens in long steps is interpolated; look for a bus or a recorder that drops "
                              "messages.",
                              share, "1");
    set_stretches(f, view, late, 5.0 * median);
    out.push_back(f);
  }
  const double quantum = decimal_quantum(steps.length, median);
  const bool coarse = quantum > 0.05 * median && jitter > 0.01;
  if (coarse) {
    out.push_back(about_time("time.coarse_stamps", graded(quantum / median, 0.0, 0.3),
                             fmt::format("Time stamps are whole multiples of {:.3g} s, {:.0f} % of a step: steps "
                                         "scatter by {:.2g} %.",
                                         quantum, 100.0 * quantum / median, 100.0 * jitter),
                             "Log time with more decimals: an error in time counts like speed times that error.",
                             quantum, "s"));
  }
  const FindingSeverity severity = coarse ? FindingSeverity::fine : graded(jitter, 0.05, 0.2);
  out.push_back(
      about_time("time.jitter", severity,
                 fmt::format("Steps scatter by {:.2g} % (standard deviation) about {:.4g} s.", 100.0 * jitter, median),
                 severity == FindingSeverity::fine
                     ? ""
                     : "Stamp where the sample is taken, not where the message arrives; steps of different "
                       "length are filtered exactly, but wrong stamps are not known to be wrong.",
                 jitter, "1"));
}

}  // namespace

void check_time(const HealthView& view, const ReaderCounts& reader, std::vector<LogFinding>& findings) {
  double seconds = 0.0;
  for (const auto& [first, last] : view.segments) {
    seconds += last > first ? view.log->t[last - 1] - view.log->t[first] : 0.0;
  }
  check_rate(view, reader, seconds, findings);
  check_length(view, seconds, findings);
  check_segments(view, seconds, findings);
  check_reader(reader, findings);
  check_steps(view, findings);
}

using model::EffortKind;

namespace {

// Whether wheel radii and track can be found without efforts.
bool has_kinematics(const HealthView& view) {
  return view.has_motion() && view.column("theta") != nullptr && model::on_two_wheels(view.robot);
}

// Columns that are missing, and what the log has instead.
void check_columns(const HealthView& view, std::vector<LogFinding>& out) {
  std::vector<std::string> motion, effort;
  for (const JointView& j : view.joints) {
    if (!j.has_motion()) {
      motion.push_back(j.speed_name + " or " + j.angle_name);
    }
    if (j.effort == nullptr) {
      effort.push_back(j.effort_name);
    }
  }
  const auto lacking = [&](const char* id, FindingSeverity severity, std::string sentence, std::string next) {
    LogFinding f{.id = id, .topic = FindingTopic::signals, .severity = severity};
    f.sentence = std::move(sentence);
    f.next = std::move(next);
    out.push_back(f);
  };
  if (!view.has_motion()) {
    lacking("signals.no_motion", FindingSeverity::fatal,
            motion.empty() ? "Some joints have speeds only and others angles only: all need one kind."
                           : fmt::format("The log lacks {}.", core::listed(motion)),
            view.log->names.empty()
                ? "No column is known: rename columns with --map NAME=COLUMN, or log the motion."
                : fmt::format("It has {}: rename columns with --map NAME=COLUMN, or log the motion.",
                              core::listed(view.log->names)));
  }
  if (!effort.empty()) {
    std::vector<std::string> others;
    for (const char* name : {"tau_r", "current_r", "voltage_r"}) {
      if (view.column(name) != nullptr) {
        others.emplace_back(name);
      }
    }
    lacking("signals.no_effort", has_kinematics(view) ? FindingSeverity::warning : FindingSeverity::fatal,
            fmt::format("The log lacks {}.", core::listed(effort)),
            others.empty()
                ? "Log torques, currents or voltages, or rename columns with --map NAME=COLUMN: without "
                  "efforts only the kinematics can be identified."
                : fmt::format("It has {}: `effort: {{kind: …}}` in the robot file says which effort is used.",
                              core::listed(others)));
  }
}

std::string names_of(const std::vector<LogFinding>& findings, FindingSeverity severity) {
  std::vector<std::string> ids;
  for (const LogFinding& f : findings) {
    if (f.severity == severity && !std::ranges::count(ids, f.id)) {
      ids.push_back(f.id);
    }
  }
  return core::listed(ids);
}

void conclude(const HealthView& view, bool reaches_bounds, LogHealth& health) {
  std::vector<LogFinding>& all = health.findings;
  std::ranges::stable_sort(all, [](const LogFinding& a, const LogFinding& b) {
    return a.severity != b.severity ? a.severity > b.severity : a.topic < b.topic;
  });
  const std::size_t fatal = health.count(FindingSeverity::fatal);

  if (fatal == 0 && reaches_bounds) {
    health.verdict = LogVerdict::commission;
    const std::size_t warnings = health.count(FindingSeverity::warning);
    health.sentence = "The log can be commissioned";
    health.sentence += warnings == 0 ? "."
                                     : fmt::format(", with {} warning{} ({}).", warnings, warnings == 1 ? "" : "s",
                                                   names_of(all, FindingSeverity::warning));
  } else if (fatal == 0 && !view.has_effort() && has_kinematics(view)) {
    health.verdict = LogVerdict::identify_only;
    health.sentence =
        "The log has no efforts: `identify` finds wheel radii and track width, but nothing can be commissioned.";
  } else {
    health.verdict = LogVerdict::unusable;
    health.sentence =
        fmt::format("The log should not be commissioned as it stands ({}).", names_of(all, FindingSeverity::fatal));
  }
}

std::string assumption(const HealthView& view) {
  if (view.robot_given) {
    return {};
  }
  const char* effort = view.robot.effort == EffortKind::torque    ? "torques"
                       : view.robot.effort == EffortKind::current ? "currents"
                                                                  : "voltages";
  return !model::on_two_wheels(view.robot)
             ? "no robot file: taken for a single axis"
             : fmt::format(
                   "no robot file: taken for a differential drive with {} as efforts; whether units fit radius, "
                   "track and mass cannot be judged",
                   effort);
}

}  // namespace

std::string_view to_string(FindingSeverity severity) {
  switch (severity) {
    case FindingSeverity::fine: return "fine";
    case FindingSeverity::notice: return "notice";
    case FindingSeverity::warning: return "warning";
    case FindingSeverity::fatal: return "fatal";
  }
  return "";
}

std::string_view to_string(FindingTopic topic) {
  switch (topic) {
    case FindingTopic::time: return "time";
    case FindingTopic::signals: return "signals";
    case FindingTopic::motion: return "motion";
    case FindingTopic::units: return "units";
  }
  return "";
}

std::string_view to_string(LogVerdict verdict) {
  switch (verdict) {
    case LogVerdict::commission: return "commission";
    case LogVerdict::identify_only: return "identify_only";
    case LogVerdict::unusable: return "unusable";
  }
  return "";
}

std::size_t LogHealth::count(FindingSeverity severity) const {
  return static_cast<std::size_t>(std::ranges::count(findings, severity, &LogFinding::severity));
}

const LogFinding* LogHealth::find(std::string_view id) const {
  const auto at = std::ranges::find(findings, id, &LogFinding::id);
  return at == findings.end() ? nullptr : &*at;
}

namespace {

constexpr double kMoved = 1.0;  // rad or m, by the other column: a column that did not change meanwhile is dead

// A column of a joint that has one value throughout, while the joint's other column moves.
bool is_dead(const HealthView& view, const std::vector<double>* column, const std::vector<double>* other, bool angle) {
  if (column == nullptr || other == nullptr || column->empty()) {
    return false;
  }
  const auto [low, high] = std::ranges::minmax(*column);
  double way = 0.0;
  for (std::size_t k = 1; k < other->size(); ++k) {
    way += angle ? std::abs((*other)[k]) * view.step : std::abs((*other)[k] - (*other)[k - 1]);
  }
  return low == high && way > kMoved;
}

// Seconds in which an angle keeps one value while the speed beside it turns the wheel, which it usually does not.
double seconds_dead(const HealthView& view, const JointView& joint) {
  constexpr double kLeast = 0.5;  // s
  constexpr double kUsual = 5.0;  // times the way of a count
  constexpr double kSlow = 0.1;   // of the top speed
  if (joint.angle == nullptr || joint.speed == nullptr) {
    return 0.0;
  }
  const std::vector<double>& t = view.log->t;
  struct Standing {
    double way, seconds;
  };
  std::vector<Standing> all;
  std::vector<double> ways;
  for (const ValueRun& run : value_runs(view, *joint.angle)) {
    double at = 0.0, least = 0.0, most = 0.0, rolled = 0.0;
    for (std::size_t k = run.first + 1; k < run.last; ++k) {
      const double step = 0.5 * ((*joint.speed)[k] + (*joint.speed)[k - 1]) * (t[k] - t[k - 1]);
      at += step;
      rolled += std::abs(step);
      least = std::min(least, at);
      most = std::max(most, at);
    }
    const double seconds = t[run.last - 1] - t[run.first], way = most - least;
    ways.push_back(way);
    if (way > kMoved && rolled > kSlow * joint.top * seconds && seconds > kLeast) {
      all.push_back({way, seconds});
    }
  }
  const double usual = ways.empty() ? 0.0 : core::quantile(std::move(ways), 0.9);
  double sum = 0.0;
  for (const Standing& one : all) {
    sum += one.way > kUsual * usual ? one.seconds : 0.0;
  }
  return sum;
}

// Angles that stand still for a while beside speeds that go on.
std::optional<LogFinding> stopped_angles(const HealthView& view) {
  std::vector<std::string> stopped, names, instead;
  double seconds = 0.0;
  for (const JointView& j : view.joints) {
    if (j.angle == nullptr || j.speed == nullptr) {
      return std::nullopt;
    }
    if (const double dead = seconds_dead(view, j); dead > 0.0) {
      stopped.push_back(j.angle_name);
      seconds = std::max(seconds, dead);
    }
    names.push_back(j.angle_name);
    instead.push_back(j.speed_name);
  }
  if (stopped.empty()) {
    return std::nullopt;
  }
  return LogFinding{
      .id = "signals.position_zero",
      .topic = FindingTopic::signals,
      .severity = FindingSeverity::warning,
      .sentence = fmt::format("{} stand{} still for {:.3g} s while {} show that the wheels turn: the speeds "
                              "are taken, the angles are not read.",
                              core::listed(stopped), stopped.size() == 1 ? "s" : "", seconds, core::listed(instead)),
      .next = "Find out why the counter stopped, or leave the columns out of the log.",
      .columns = names,
      .value = seconds,
      .unit = "s",
      .hides = true};
}

// Angles that stand still beside speeds, of one wheel or of all, or speeds that do beside angles.
std::optional<LogFinding> dead_columns(const HealthView& view) {
  for (const bool angle : {true, false}) {
    std::vector<std::string> dead, names, instead;
    bool all = true;
    for (const JointView& j : view.joints) {
      const auto *column = angle ? j.angle : j.speed, *other = angle ? j.speed : j.angle;
      all = all && other != nullptr && !is_dead(view, other, column, !angle);
      if (is_dead(view, column, other, angle)) {
        dead.push_back(angle ? j.angle_name : j.speed_name);
      }
      if (column != nullptr) {
        names.push_back(angle ? j.angle_name : j.speed_name);
      }
      instead.push_back(angle ? j.speed_name : j.angle_name);
    }
    if (all && !dead.empty()) {
      return LogFinding{.id = angle ? "signals.position_zero" : "signals.speed_zero",
                        .topic = FindingTopic::signals,
                        .severity = FindingSeverity::warning,
                        .sentence = fmt::format("{} never change{} while {} move: {} taken, {} not read.",
                                                core::listed(dead), dead.size() == 1 ? "s" : "", core::listed(instead),
                                                instead.size() == 1 ? "that is" : "these are",
                                                names.size() == 1 ? "it is" : "the others are"),
                        .next = "Fill the field in the driver, or leave the columns out of the log.",
                        .columns = names,
                        .hides = true};
    }
  }
  return stopped_angles(view);
}

LogTable without(const LogTable& log, const std::vector<std::string>& names) {
  LogTable kept;
  kept.t = log.t;
  kept.segment_starts = log.segment_starts;
  for (std::size_t c = 0; c < log.names.size(); ++c) {
    if (std::ranges::count(names, log.names[c]) == 0) {
      kept.names.push_back(log.names[c]);
      kept.columns.push_back(log.columns[c]);
    }
  }
  return kept;
}

}  // namespace

namespace {

// Wheels whose motion is not what was logged explain neither turning nor displacement, and the same holds for a
// heading of another unit or sign: then nothing is said of the kind of drive. Rows of two sources make nonsense of
// every unit.
void drop_consequences(const HealthView& view, const ReaderCounts& reader, LogHealth& health) {
  const auto motion = motion_columns(view);
  const auto of_motion = [&](const LogFinding& f) {
    return std::ranges::any_of(f.columns, [&](const auto& name) { return std::ranges::count(motion, name) > 0; });
  };
  const bool unlike = std::ranges::any_of(health.findings, [&](const LogFinding& f) {
    constexpr std::array<std::string_view, 4> ids = {"signals.no_direction", "units.heading", "units.heading_sign",
                                                     "units.position_mirrored"};
    return f.severity == FindingSeverity::fatal &&
           (std::ranges::count(ids, f.id) > 0 || (f.id == "signals.constant" && of_motion(f)) ||
            f.id == "units.angle_and_speed");
  });
  const bool mixed = health.find("signals.two_sources") != nullptr;
  std::erase_if(health.findings, [&](const LogFinding& f) {
    const bool drive = f.id == "motion.not_differential_drive" && reader.contradictions.empty();
    return (drive && (unlike || mixed)) || (mixed && f.topic == FindingTopic::units);
  });
}

// Wheels that never go backwards although something else says that they do: their sensors may see no direction.
void tell_never_backwards(const HealthView& view, LogHealth& health) {
  const auto never = [](const JointView& joint) {
    return joint.angle != nullptr ? std::ranges::is_sorted(*joint.angle)
                                  : joint.speed != nullptr && std::ranges::min(*joint.speed) >= 0.0;
  };
  if (view.joints.empty() || !std::ranges::all_of(view.joints, never)) {
    return;
  }
  for (LogFinding& f : health.findings) {
    if (f.severity == FindingSeverity::fatal &&
        (f.id == "motion.not_differential_drive" || f.id == "units.effort_sign" || f.id == "units.odometry")) {
      f.sentence +=
          fmt::format(" Yet no wheel ever turns back: where the robot did, {} a sensor without a direction of its own.",
                      view.joints.front().angle != nullptr ? "the angles are those of" : "the speeds are those of");
      f.next += " Count both channels of an encoder, or record a drive in which no wheel reverses.";
    }
  }
}

}  // namespace

LogHealth examine(const LogTable& stamped, const std::optional<Robot>& robot, const ReaderCounts& reader,
                  std::size_t threads) {
  const HealthView as_stamped = make_view(stamped, robot);
  if (auto dead = dead_columns(as_stamped)) {
    LogHealth health = examine(without(stamped, dead->columns), robot, reader, threads);
    health.findings.push_back(std::move(*dead));
    conclude(as_stamped, health.verdict == LogVerdict::commission, health);
    return health;
  }
  LogHealth health;
  health.clock = check_clock(as_stamped, health.findings);
  const std::optional<LogTable> even =
      health.clock ? std::optional(core::read_evenly(stamped, *health.clock)) : std::nullopt;
  std::optional<LogTable> straight;
  if (const auto offset = check_heading(make_view(even ? *even : stamped, robot), health.findings)) {
    straight = even ? *even : stamped;
    std::ranges::for_each(straight->column("theta"), [&](double& heading) { heading += *offset; });
  }
  const LogTable& log = straight ? *straight : even ? *even : stamped;
  const HealthView view = make_view(log, robot);
  health.rows = log.rows();
  health.segments = view.segments.size();
  health.median_step = view.step;
  for (const auto& [first, last] : view.segments) {
    health.seconds += last > first ? log.t[last - 1] - log.t[first] : 0.0;
  }
  health.assumed = assumption(view);
  check_columns(view, health.findings);
  check_time(view, reader, health.findings);
  bool reaches_bounds = false;
  // Speeds and delays by a clock in another unit would be nonsense.
  if (log.rows() > 0 && health.find("units.time") == nullptr) {
    std::vector<LogFinding> of_motion;
    core::both(
        threads,
        [&] {
          check_signals(view, reader, health.findings);
          check_rounding(view, health.findings);
          check_spikes(view, reader, health.findings);
          check_odometry(view, health.findings);
          check_gyro_delay(view, health.findings);
          check_sources(view, health.findings);
          check_drive(view, reader, health.findings);
        },
        [&] { reaches_bounds = !check_direction(view, of_motion) && check_motion(view, of_motion); });
    std::ranges::move(of_motion, std::back_inserter(health.findings));
    drop_consequences(view, reader, health);
    tell_never_backwards(view, health);
    const LogFinding* smoothed = health.find("signals.speed_filter");
    if (smoothed != nullptr && smoothed->speed_filter) {  // that is why the wheels are later than a gyro
      std::erase_if(health.findings, [](const LogFinding& f) { return f.id == "time.gyro_delay"; });
    }
  }
  conclude(view, reaches_bounds, health);
  return health;
}

namespace {

constexpr std::size_t kHalfWindow = 5;  // rows to each side for a smooth speed
constexpr double kMoves = 0.05;         // of the top speed

// Geometry one: excitation does not depend on it.
Robot stand_in(const LogTable& log) {
  Robot robot;
  robot.name = "unknown";
  const auto has = [&](const char* name) { return log.find(name) != nullptr; };
  const bool wheels = has("omega_r") || has("omega_l") || has("phi_r") || has("phi_l");
  if (!wheels && (has("position") || has("velocity"))) {
    robot.model = "single_axis";
    return robot;
  }
  robot.wheel_radius = 1.0;
  robot.track_width = 2.0;
  const auto both = [&](const char* right, const char* left) { return has(right) && has(left); };
  robot.effort = both("tau_r", "tau_l")           ? EffortKind::torque
                 : both("current_r", "current_l") ? EffortKind::current
                 : both("voltage_r", "voltage_l") ? EffortKind::voltage
                                                  : EffortKind::torque;
  return robot;
}

std::vector<double> smooth_speed(const HealthView& view, const JointView& joint) {
  const std::vector<double>& t = view.log->t;
  std::vector<double> out(t.size(), 0.0);
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first; k < last; ++k) {
      const std::size_t a = k < first + kHalfWindow ? first : k - kHalfWindow;
      const std::size_t b = std::min(k + kHalfWindow, last - 1);
      if (joint.angle != nullptr) {
        out[k] = b > a ? ((*joint.angle)[b] - (*joint.angle)[a]) / (t[b] - t[a]) : 0.0;
      } else {
        double sum = 0.0;
        for (std::size_t i = a; i <= b; ++i) {
          sum += (*joint.speed)[i];
        }
        out[k] = sum / static_cast<double>(b - a + 1);
      }
    }
  }
  return out;
}

double top_of(std::vector<double> values) {
  if (values.empty()) {
    return 0.0;
  }
  std::ranges::transform(values, values.begin(), [](double v) { return std::abs(v); });
  const auto rank = static_cast<std::size_t>(0.99 * static_cast<double>(values.size() - 1));
  return core::order_statistic(std::move(values), rank);
}

}  // namespace

const std::vector<double>* HealthView::column(const std::string& name) const { return log->find(name); }

bool HealthView::has_motion() const {
  return std::ranges::all_of(joints, [](const JointView& j) { return j.angle != nullptr; }) ||
         std::ranges::all_of(joints, [](const JointView& j) { return j.speed != nullptr; });
}

bool HealthView::has_effort() const {
  return std::ranges::all_of(joints, [](const JointView& j) { return j.effort != nullptr; });
}

bool HealthView::one_sided(const JointView& joint) const {
  const std::vector<double>& effort = *joint.effort;
  const double most = effort.empty() ? 0.0 : *std::ranges::max_element(effort);
  std::size_t negative = 0, back = 0;
  for (std::size_t k = 0; k < effort.size(); ++k) {
    negative += effort[k] < -0.05 * most ? 1U : 0U;
    back += joint.smooth[k] < -0.1 * joint.top ? 1U : 0U;
  }
  return most > 0.0 && 200 * negative < effort.size() && 50 * back > effort.size();
}

HealthView make_view(const LogTable& log, const std::optional<Robot>& robot) {
  HealthView view;
  view.log = &log;
  for (const auto& column : log.columns) {
    check::that(column.size() == log.rows(), "log", "columns as long as its time");
  }
  core::check_segments(log);
  view.robot_given = robot.has_value();
  view.robot = robot ? *robot : stand_in(log);
  view.model = model::make_model(view.robot);
  view.step = core::median_step(log.t);
  std::vector<std::size_t> starts = log.segment_starts;
  if (starts.empty() || starts.front() != 0) {
    starts.insert(starts.begin(), 0);
  }
  for (std::size_t s = 0; s < starts.size(); ++s) {
    view.segments.emplace_back(starts[s], s + 1 < starts.size() ? starts[s + 1] : log.rows());
  }
  for (const model::Joint& joint : view.model.joints) {
    JointView j;
    j.angle_name = joint.angle;
    j.speed_name = joint.speed;
    j.effort_name = model::effort_column(joint, view.robot.effort);
    j.angle = view.column(j.angle_name);
    j.speed = view.column(j.speed_name);
    j.effort = view.column(j.effort_name);
    view.joints.push_back(j);
  }
  view.moving.assign(log.rows(), false);
  for (JointView& j : view.joints) {
    if (!j.has_motion()) {
      continue;
    }
    j.smooth = smooth_speed(view, j);
    j.top = top_of(j.smooth);
    for (std::size_t k = 0; k < log.rows(); ++k) {
      view.moving[k] = view.moving[k] || std::abs(j.smooth[k]) > kMoves * j.top;
    }
  }
  view.robot.effort_unsigned =
      view.robot.effort_unsigned ||
      (!view.robot_given && view.has_motion() && view.has_effort() &&
       std::ranges::any_of(view.joints, [&](const JointView& j) { return view.one_sided(j); }));
  return view;
}

void set_stretches(LogFinding& finding, const HealthView& view, const std::vector<bool>& flagged, double join) {
  const std::vector<double>& t = view.log->t;
  finding.when.clear();
  finding.stretches = 0;
  for (const auto& [first, last] : view.segments) {
    bool open = false;
    double from = 0.0, to = 0.0;
    const auto close = [&] {
      if (open && ++finding.stretches <= kMostStretches) {
        finding.when.push_back({from, to});
      }
      open = false;
    };
    for (std::size_t k = first; k < last; ++k) {
      if (!flagged[k]) {
        continue;
      }
      if (open && t[k] - to > join) {
        close();
      }
      from = open ? from : t[k];
      to = t[k];
      open = true;
    }
    close();
  }
}

std::string scaling_arguments(const HealthView& view, const std::vector<std::string>& columns, double factor) {
  std::vector<std::string> maps;
  for (const std::string& name : columns) {
    if (view.column(name) != nullptr) {
      maps.push_back(fmt::format("--map {}=\"*{:.6g}\"", name, factor));
    }
  }
  return fmt::format("`{}`", fmt::join(maps, " "));
}

std::vector<std::string> motion_columns(const HealthView& view) {
  std::vector<std::string> names;
  for (const JointView& j : view.joints) {
    names.push_back(j.angle_name);
    names.push_back(j.speed_name);
  }
  return names;
}

std::string unit_for_ratio(double ratio, bool rates) {
  struct Known {
    double ratio;
    const char* unit;
  };
  constexpr Known kRates[] = {
      {57.29577951308232, "deg/s"}, {9.549296585513721, "rpm"}, {0.15915494309189535, "turns/s"}};
  constexpr Known kOthers[] = {
      {57.29577951308232, "degrees"}, {1000.0, "thousandths"}, {100.0, "hundredths"}, {0.001, "thousands"}};
  const auto fits = [&](const Known& k) { return std::abs(ratio / k.ratio - 1.0) < 0.1; };
  for (const Known& k : kRates) {
    if (rates && fits(k)) {
      return k.unit;
    }
  }
  for (const Known& k : kOthers) {
    if (!rates && fits(k)) {
      return k.unit;
    }
  }
  return {};
}

}  // namespace wheelwright::doctor

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>

#include <fmt/format.h>

#include "commission/doctor/health_efforts.hpp"
#include "commission/doctor/log_health.hpp"
#include "core/error.hpp"
#include "identify/inference/noise_levels.hpp"
#include "identify/noise_level.hpp"
#include "model/filter/encoder.hpp"

namespace wheelwright::doctor {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr std::size_t kManyJumps = 20;  // of a wheel angle, of rows of several sources
constexpr double kJumpingShare = 0.01;  // of the rows, likewise
constexpr std::size_t kLongRun = 20;    // rows of one value from which on a column may be stuck
constexpr double kLongTime = 0.5;       // s, likewise
constexpr std::size_t kPinned = 5;      // rows at an extreme value that make a limit
constexpr double kFresh = 0.6;          // distinct values per change above which a column is finely resolved

using Run = ValueRun;

double mean_rows(const std::vector<Run>& runs) {
  double rows = 0.0;
  for (const Run& run : runs) {
    rows += static_cast<double>(run.rows());
  }
  return runs.empty() ? 0.0 : rows / static_cast<double>(runs.size());
}

std::size_t distinct(const std::vector<Run>& runs) {
  std::vector<double> values(runs.size());
  std::ranges::transform(runs, values.begin(), &Run::value);
  std::ranges::sort(values);
  return static_cast<std::size_t>(std::unique(values.begin(), values.end()) - values.begin());
}

LogFinding about(const char* id, FindingSeverity severity, const std::string& column, std::string sentence,
                 std::string next, double value, std::string unit) {
  return {.id = id,
          .topic = FindingTopic::signals,
          .severity = severity,
          .sentence = std::move(sentence),
          .next = std::move(next),
          .columns = {column},
          .value = value,
          .unit = std::move(unit)};
}

void mark(std::vector<bool>& flagged, const Run& run) {
  std::fill(flagged.begin() + static_cast<std::ptrdiff_t>(run.first),
            flagged.begin() + static_cast<std::ptrdiff_t>(run.last), true);
}

// A column of one kind: what stuck and stale values mean depends on it.
enum class ColumnKind { speed, angle, effort, pose };

struct Column {
  std::string name;
  const std::vector<double>* values;
  ColumnKind kind;
  const JointView* joint;  // nullptr for the pose
};

std::vector<Column> columns_of(const HealthView& view) {
  std::vector<Column> all;
  for (const JointView& j : view.joints) {
    const auto add = [&](const std::string& name, const std::vector<double>* values, ColumnKind kind) {
      if (values != nullptr && !values->empty()) {
        all.push_back({name, values, kind, &j});
      }
    };
    add(j.angle_name, j.angle, ColumnKind::angle);
    add(j.speed_name, j.speed, ColumnKind::speed);
    add(j.effort_name, j.effort, ColumnKind::effort);
  }
  for (const char* name : {"x", "y", "theta", "gyro_z"}) {
    if (const std::vector<double>* values = view.column(name); values != nullptr && !values->empty()) {
      all.push_back({name, values, ColumnKind::pose, nullptr});
    }
  }
  return all;
}

// Whether the joint moves in `run` by another column of it; nothing where there is none.
std::optional<bool> moves_by_itself(const Column& c, const Run& run) {
  const bool is_angle = c.kind == ColumnKind::angle;
  const std::vector<double>* other = c.joint == nullptr ? nullptr : is_angle ? c.joint->speed : c.joint->angle;
  if (other == nullptr) {
    return std::nullopt;
  }
  if (!is_angle) {
    return (*other)[run.last - 1] != (*other)[run.first];
  }
  double sum = 0.0;
  for (std::size_t k = run.first; k < run.last; ++k) {
    sum += std::abs((*other)[k]);
  }
  return sum / static_cast<double>(run.rows()) > 0.1 * c.joint->top;
}

bool is_stuck(const HealthView& view, const Column& c, const Run& run, double usual) {
  const std::vector<double>& t = view.log->t;
  const bool is_long = run.rows() >= kLongRun && t[run.last - 1] - t[run.first] >= kLongTime &&
                       static_cast<double>(run.rows()) > 5.0 * usual;
  if (!is_long || !mostly_moves(view, run)) {
    return false;
  }
  switch (c.kind) {
    case ColumnKind::speed: return run.value != 0.0 || moves_by_itself(c, run).value_or(false);
    case ColumnKind::angle: return moves_by_itself(c, run).value_or(false);
    case ColumnKind::effort: return false;  // what its motion says of it: check_frozen_efforts()
    case ColumnKind::pose: return false;    // a straight drive along an axis holds a coordinate
  }
  return false;
}

void check_stuck(const HealthView& view, const Column& c, const std::vector<Run>& runs, std::vector<LogFinding>& out) {
  const auto [low, high] = std::ranges::minmax(*c.values);
  if (low == high) {
    const bool needed = c.kind == ColumnKind::effort ||
                        (c.joint != nullptr && c.name == c.joint->motion_name() && c.kind != ColumnKind::pose);
    out.push_back(about("signals.constant", needed ? FindingSeverity::fatal : FindingSeverity::notice, c.name,
                        fmt::format("{} is {:.6g} in every row.", c.name, low),
                        needed ? "Check that the sensor is connected and that the right column is read (--map)." : "",
                        low, ""));
    out.back().refuses = needed && std::ranges::count(view.moving, true) > 0;
    return;
  }
  std::vector<bool> flagged(view.log->rows(), false);
  double seconds = 0.0;
  const double usual = mean_rows(runs);
  for (const Run& run : runs) {
    if (is_stuck(view, c, run, usual)) {
      mark(flagged, run);
      seconds += view.log->t[run.last - 1] - view.log->t[run.first];
    }
  }
  if (seconds > 0.0) {
    LogFinding f = about("signals.stuck", FindingSeverity::warning, c.name, "",
                         "Leave these stretches out, or find out why the sensor stopped; a model learned from them "
                         "takes them for healthy.",
                         seconds, "s");
    set_stretches(f, view, flagged, view.step * 2.0);
    f.sentence = fmt::format("{} does not change for {:.3g} s in {} stretch{} while the robot moves.", c.name, seconds,
                             f.stretches, f.stretches == 1 ? "" : "es");
    out.push_back(f);
  }
}

// How many rows a value of the column lasts on average, where it is repeated; nothing where it is not.
std::optional<double> repeats(const HealthView& view, const Column& c, const std::vector<Run>& all) {
  std::vector<Run> runs;
  for (const Run& run : all) {
    if (mostly_moves(view, run) && run.rows() < kLongRun && (c.kind != ColumnKind::effort || run.value != 0.0)) {
      runs.push_back(run);
    }
  }
  if (runs.size() < 20) {
    return std::nullopt;
  }
  const double mean = mean_rows(runs);
  const bool stale = mean > 1.3 && static_cast<double>(distinct(runs)) > kFresh * static_cast<double>(runs.size());
  return stale ? std::optional(mean) : std::nullopt;
}

// One finding for all columns of a kind; `rows` is how long a value lasts in each.
void tell_stale(const HealthView& view, const std::vector<std::string>& names, double rows, bool is_motion,
                std::vector<LogFinding>& out) {
  LogFinding f =
      about("signals.stale", is_motion ? FindingSeverity::warning : FindingSeverity::notice, "",
            fmt::format("{} {} new in one row of {:.2g}: at {:.3g} Hz, and repeated in between.",
                        fmt::join(names, ", "), names.size() > 1 ? "are" : "is", rows, 1.0 / (rows * view.step)),
            is_motion ? fmt::format("Log at the rate of the sensor, or with the time at which each value was "
                                    "new: a repeated value is late by up to {:.2g} s.",
                                    rows * view.step)
                      : "",
            rows, "1");
  f.columns = names;
  out.push_back(f);
}

void check_limit(const HealthView& view, const Column& c, const std::vector<Run>& runs, std::vector<LogFinding>& out) {
  const auto limit = view.robot.limits.find("effort");
  const bool declared = limit != view.robot.limits.end();
  const auto [low, high] = std::ranges::minmax(*c.values);
  std::vector<bool> flagged(view.log->rows(), false);
  std::size_t pinned = 0, stretches = 0;
  std::vector<Run> elsewhere;
  for (const Run& run : runs) {
    const bool extreme = (run.value == high && high > 0.0) || (run.value == low && low < 0.0);
    if (declared ? std::abs(run.value) >= 0.98 * limit->second : extreme && run.rows() >= kPinned) {
      mark(flagged, run);
      pinned += run.rows();
      ++stretches;
    } else {
      elsewhere.push_back(run);
    }
  }
  const double usual = mean_rows(elsewhere);
  const double mean = stretches > 0 ? static_cast<double>(pinned) / static_cast<double>(stretches) : 0.0;
  if (pinned < kPinned || (!declared && mean < 3.0 * usual)) {
    return;
  }
  const double share = static_cast<double>(pinned) / static_cast<double>(view.log->rows());
  LogFinding f = about(
      "signals.saturation", share > 0.002 ? FindingSeverity::warning : FindingSeverity::notice, c.name, "",
      declared ? "Drive more gently, or leave these stretches out: where the logged effort is the command before the "
                 "limit, the model is wrong there."
               : "Drive more gently, and write `limits: {effort: …}` into the robot file; where the logged effort "
                 "is the command before the limit, the model is wrong there.",
      share, "1");
  set_stretches(f, view, flagged, 2.0 * view.step);
  f.sentence = fmt::format("{} stays at {} in {:.2g} % of the rows ({} stretch{}){}.", c.name,
                           declared ? fmt::format("its limit of {:.4g}", limit->second)
                                    : fmt::format("its extreme value ({:.4g} or {:.4g})", low, high),
                           100.0 * share, f.stretches, f.stretches == 1 ? "" : "es",
                           declared ? "" : ": a limit, or a command that was held");
  out.push_back(f);
}

void check_resolution(const HealthView& view, const Column& c, const std::vector<Run>& runs,
                      std::vector<LogFinding>& out) {
  if (c.kind == ColumnKind::pose) {
    return;
  }
  if (c.kind == ColumnKind::effort) {
    const std::size_t values = distinct(runs);
    if (values > 1 && values < 64 && view.log->rows() > 200 && runs.size() > 3 * values) {
      out.push_back(about("signals.coarse", values < 16 ? FindingSeverity::warning : FindingSeverity::notice, c.name,
                          fmt::format("{} takes only {} different values.", c.name, values),
                          "Log the effort with its full resolution.", static_cast<double>(values), "1"));
    }
    return;
  }
  std::vector<double> sample;
  const bool is_angle = c.kind == ColumnKind::angle;
  for (const auto& [first, last] : view.segments) {
    for (std::size_t k = first + 1; k < last && sample.size() < 100000; ++k) {
      sample.push_back(is_angle ? (*c.values)[k] - (*c.values)[k - 1] : (*c.values)[k]);
    }
  }
  const auto encoder = !model::on_two_wheels(view.robot) || !(view.step > 0.0) ? std::nullopt
                       : is_angle                                              ? filter::find_encoder_of_angles(sample)
                                  : filter::find_encoder(sample, view.step);
  if (!encoder) {
    return;
  }
  const auto& told = view.robot.encoder_counts_per_turn;
  const double count_rate = is_angle ? encoder->speed_step / view.step : encoder->speed_step;
  const double share = c.joint->top > 0.0 ? count_rate / c.joint->top : 0.0;
  const bool contradicts = told && std::abs(*told / encoder->counts_per_turn - 1.0) > 0.01 &&
                           std::abs(std::remainder(*told / encoder->counts_per_turn, 1.0)) > 0.01;
  const FindingSeverity severity = contradicts                              ? FindingSeverity::warning
                                   : !is_angle && share > 0.1               ? FindingSeverity::notice
                                   : view.robot_given && !told && !is_angle ? FindingSeverity::notice
                                                                            : FindingSeverity::fine;
  std::string next;
  if (contradicts) {
    next = fmt::format("The robot file says {:.6g}: correct one of them.", *told);
  } else if (!told) {
    next = fmt::format(
        "Write `encoder_counts_per_turn: {:.0f}` into the robot file: half a count is then the noise "
        "bound.",
        encoder->counts_per_turn);
  }
  out.push_back(about("signals.encoder", severity, c.name,
                      fmt::format("{} is made of encoder counts, {:.0f} a turn: one count in a step is {:.2g} rad/s, "
                                  "{:.2g} % of the top speed.",
                                  c.name, encoder->counts_per_turn, count_rate, 100.0 * share),
                      next, encoder->counts_per_turn, "counts"));
}

void check_noise(const HealthView& view, const std::vector<Column>& columns, std::vector<LogFinding>& out) {
  std::vector<std::string> names;
  std::vector<const Column*> asked;
  for (const Column& c : columns) {
    if (c.kind == ColumnKind::speed || c.kind == ColumnKind::effort) {
      names.push_back(c.name);
      asked.push_back(&c);
    }
  }
  if (names.empty()) {
    return;
  }
  TableSource source(*view.log);
  const std::vector<identify::DifferenceNoise> noises = identify::difference_noise(source, names);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const identify::DifferenceNoise& noise = noises[i];
    const bool told =
        noise.kind == identify::DifferenceNoise::Kind::white || noise.kind == identify::DifferenceNoise::Kind::rough;
    double squares = 0.0, rows = 0.0;
    for (std::size_t k = 0; k < view.log->rows(); ++k) {
      squares += view.moving[k] ? (*asked[i]->values)[k] * (*asked[i]->values)[k] : 0.0;
      rows += view.moving[k] ? 1.0 : 0.0;
    }
    const double rms = rows > 0.0 ? std::sqrt(squares / rows) : 0.0;
    if (!told || !(rms > 0.0)) {
      continue;
    }
    const double share = noise.sd / rms;
    const FindingSeverity severity = share > 0.5    ? FindingSeverity::warning
                                     : share > 0.15 ? FindingSeverity::notice
                                                    : FindingSeverity::fine;
    out.push_back(about("signals.noise", severity, names[i],
                        fmt::format("{} has noise of standard deviation {:.2g}, {:.2g} % of its size in motion ({:.3g} "
                                    "rms).",
                                    names[i], noise.sd, 100.0 * share, rms),
                        severity == FindingSeverity::fine
                            ? ""
                            : "Thresholds will be as wide as the filtered noise: a better sensor, or a slower filter "
                              "(smaller beta) and longer drives.",
                        share, "1"));
  }
}

void check_rest(const HealthView& view, const std::vector<Column>& columns, std::vector<LogFinding>& out) {
  TableSource source(*view.log);
  const inference::StandstillSigns signs = inference::standstill_signs(source, view.model);
  std::vector<std::string> efforts;
  for (const Column& c : columns) {
    if (c.kind == ColumnKind::effort) {
      efforts.push_back(c.name);
    }
  }
  if (efforts.empty() || (signs.commands.empty() && signs.speeds.empty() && signs.angles.empty())) {
    return;
  }
  const inference::Standstill rest = inference::standstill_noise(source, signs, efforts);
  LogFinding f{.id = "signals.standstill", .topic = FindingTopic::signals};
  const double moving = static_cast<double>(std::ranges::count(view.moving, true));
  const double share = 1.0 - moving / static_cast<double>(view.log->rows());
  f.value = rest.seconds;
  f.unit = std::string("s");
  if (rest.stretches == 0) {
    f.severity = FindingSeverity::notice;
    f.sentence = "The robot never rests for long enough to see the noise and the offset of its efforts at standstill.";
    f.next = "Let it stand for three seconds at the beginning and at the end of the next recording.";
  } else {
    f.sentence = fmt::format("The robot rests for {:.3g} s in {} stretch{}.", rest.seconds, rest.stretches,
                             rest.stretches == 1 ? "" : "es");
  }
  out.push_back(f);
  if (share > 0.6) {
    std::vector<bool> still = view.moving;
    still.flip();
    LogFinding s{.id = "signals.little_motion",
                 .topic = FindingTopic::signals,
                 .severity = FindingSeverity::warning,
                 .sentence = fmt::format("In {:.0f} % of the rows the robot hardly moves.", 100.0 * share),
                 .next = "Only motion tells the parameters: record more driving."};
    s.value = share;
    s.unit = std::string("1");
    set_stretches(s, view, still, 1.0);
    out.push_back(s);
  }
}

// Wheel angles that come back every turn.
void check_wrapped(const HealthView& view, const ReaderCounts& reader, std::vector<LogFinding>& out) {
  if (reader.jumps > kManyJumps &&
      static_cast<double>(reader.jumps) > kJumpingShare * static_cast<double>(reader.rows_read)) {
    out.push_back(
        about("signals.two_sources", FindingSeverity::fatal, "",
              fmt::format("Wheel angles jump as no wheel turns {} times in {} rows: these are rows of two or more "
                          "sources, each with angles of its own.",
                          reader.jumps, reader.rows_read),
              "Stop all publishers of this topic but the robot's (`ros2 topic info -v TOPIC` names them), or "
              "leave the rows of the others out of the log.",
              static_cast<double>(reader.jumps), "1"));
    out.back().refuses = true;
  } else if (reader.jumps > 0) {
    out.push_back(
        about("signals.jumps", FindingSeverity::warning, "",
              fmt::format("A wheel angle jumps as no wheel turns {} time{}: the log was cut there.", reader.jumps,
                          reader.jumps == 1 ? "" : "s"),
              "Where a counter is set back, no more is lost than the filter settles in. Where an angle is wrapped "
              "at another value than 2π, or counts degrees, log speeds beside it, or angles that go on.",
              static_cast<double>(reader.jumps), "1"));
  }
  if (reader.unwrapped > 0) {
    out.push_back(
        about("signals.wrapped", FindingSeverity::notice, "",
              fmt::format("Wheel angles jump back {} times by the range of their counter, a turn or more: they are "
                          "wrapped, and were unwrapped on reading.",
                          reader.unwrapped),
              "Log angles that go on, where the driver has them: a wrapped one is lost where rows are missing.",
              static_cast<double>(reader.unwrapped), "1"));
  }
  for (const JointView& j : view.joints) {
    if (j.angle == nullptr || view.model.joints.size() != 2) {
      continue;
    }
    std::size_t jumps = 0;
    for (const auto& [first, last] : view.segments) {
      for (std::size_t k = first + 1; k < last; ++k) {
        const double step = std::abs((*j.angle)[k] - (*j.angle)[k - 1]);
        jumps += std::abs(step - kTurn) < 0.25 * kTurn ? 1U : 0U;
      }
    }
    const auto [least, most] = std::ranges::minmax(*j.angle);
    if (jumps > 0 && most - least <= kTurn + 1e-3) {
      out.push_back(about(
          "signals.wrapped", FindingSeverity::fatal, j.angle_name,
          fmt::format("{} never leaves one turn and jumps by one {} times: it is wrapped at 2π.", j.angle_name, jumps),
          "Unwrap it: an angle has to go on counting.", static_cast<double>(jumps), "1"));
    }
  }
}

}  // namespace

void check_signals(const HealthView& view, const ReaderCounts& reader, std::vector<LogFinding>& findings) {
  const std::vector<Column> columns = columns_of(view);
  check_wrapped(view, reader, findings);
  std::map<ColumnKind, std::pair<std::vector<std::string>, double>> stale;
  for (const Column& c : columns) {
    const std::vector<Run> runs = value_runs(view, *c.values);
    check_stuck(view, c, runs, findings);
    if (const auto rows = repeats(view, c, runs)) {
      auto& [names, most] = stale[c.kind];
      names.push_back(c.name);
      most = std::max(most, *rows);
    }
    if (c.kind == ColumnKind::effort) {
      check_limit(view, c, runs, findings);
    }
    check_resolution(view, c, runs, findings);
  }
  for (const auto& [kind, found] : stale) {
    tell_stale(view, found.first, found.second, kind == ColumnKind::speed || kind == ColumnKind::angle, findings);
  }
  check_noise(view, columns, findings);
  check_rest(view, columns, findings);
}

}  // namespace wheelwright::doctor

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/doctor/log_health.hpp>

#include <algorithm>

#include <fmt/format.h>

#include <wheelwright/doctor/health_view.hpp>

namespace wheelwright {
namespace {

std::string listed(const std::vector<std::string>& names) { return fmt::format("{}", fmt::join(names, ", ")); }

// Whether wheel radii and track can be found without efforts.
bool has_kinematics(const HealthView& view) {
  return view.has_motion() && view.column("theta") != nullptr && view.robot.model != "single_axis";
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
    lacking(
        "signals.no_motion", FindingSeverity::fatal,
        motion.empty() ? "Some joints have speeds only and others angles only: all need one kind."
                       : fmt::format("The log lacks {}.", listed(motion)),
        fmt::format("It has {}: rename columns with --map NAME=COLUMN, or log the motion.", listed(view.log->names)));
  }
  if (!effort.empty()) {
    std::vector<std::string> others;
    for (const char* name : {"tau_r", "current_r", "voltage_r"}) {
      if (view.column(name) != nullptr) {
        others.emplace_back(name);
      }
    }
    lacking("signals.no_effort", has_kinematics(view) ? FindingSeverity::warning : FindingSeverity::fatal,
            fmt::format("The log lacks {}.", listed(effort)),
            others.empty()
                ? "Log torques, currents or voltages, or rename columns with --map NAME=COLUMN: without "
                  "efforts only the kinematics can be identified."
                : fmt::format("It has {}: `effort: {{kind: …}}` in the robot file says which effort is used.",
                              listed(others)));
  }
}

std::string names_of(const std::vector<LogFinding>& findings, FindingSeverity severity) {
  std::vector<std::string> ids;
  for (const LogFinding& f : findings) {
    if (f.severity == severity && !std::ranges::count(ids, f.id)) {
      ids.push_back(f.id);
    }
  }
  return listed(ids);
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
  return view.robot.model == "single_axis"
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

LogHealth examine(const LogTable& log, const std::optional<Robot>& robot, const ReaderCounts& reader) {
  const HealthView view = make_view(log, robot);
  LogHealth health;
  health.rows = log.rows();
  health.segments = view.segments.size();
  health.median_step = view.step;
  for (const auto& [first, last] : view.segments) {
    health.seconds += last > first ? log.t[last - 1] - log.t[first] : 0.0;
  }
  health.assumed = assumption(view);
  check_columns(view, health.findings);
  check_time(view, reader, health.findings);
  if (log.rows() > 0) {
    check_signals(view, reader, health.findings);
    check_odometry(view, health.findings);
  }
  const bool reaches_bounds = log.rows() > 0 && check_motion(view, health.findings);
  conclude(view, reaches_bounds, health);
  return health;
}

}  // namespace wheelwright

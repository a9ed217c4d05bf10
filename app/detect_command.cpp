// SPDX-License-Identifier: Apache-2.0
#include <unistd.h>

#include <algorithm>
#include <memory>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/follow.hpp"
#include "app/log_files.hpp"
#include "app/options.hpp"
#include "app/report_pages.hpp"
#include "app/series.hpp"
#include "app/units.hpp"
#include "commission/watch/detector_walk.hpp"
#include "commission/watch/incident_watch.hpp"
#include "commission/watch/other_parameters.hpp"
#include "commission/watch/risk_watch.hpp"
#include "detector/online_model.hpp"
#include "formats/files/bytes.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/robots/online_model_file.hpp"
#include "results/detection_json.hpp"
#include "results/report/detect_report.hpp"
#include "results/report/page.hpp"
#include "results/software.hpp"
#include "results/words/detect_summary.hpp"

namespace wheelwright::app {
using namespace words;
namespace detect_command {
namespace {

struct Arguments {
  std::filesystem::path log;
  std::filesystem::path model;
  std::filesystem::path series;
  bool layouts = false;
  double heartbeat = 0.0;
  bool follow = false;
  detector::DetectorOptions detector;
  std::optional<detector::Persistence> persistence;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Looks for faults in a log with a commissioned model: the residual of filtered torque against the threshold that "
    "no "
    "fault-free robot within its bounds can exceed, and where the log has a pose or a gyro, wheel odometry against it.";

constexpr const char* kExamples =
    "Examples:\n"
    "  wheelwright detect drive.csv --model result/model.json --out check\n"
    "  wheelwright detect drive.mcap --model result/model.json --series residual.mcap --layouts\n"
    "  wheelwright detect drive.csv --model result/model.json --residual d2\n"
    "  robot_driver | wheelwright detect --follow --model result/model.json\n\n"
    "Exit code: 0 no fault, 1 a fault was found, 2 bad input, or it could not be decided: at no instant, at fewer "
    "than\n"
    "half of the rows, or, with --follow, at none of the last ones. --follow tells such spells as they come (blind),\n"
    "and when no row has come for 5 s (silent). With --out they are appended to DIR/events.jsonl, too.";

// Files that --series and --layouts may write.
std::vector<std::filesystem::path> series_files(const Arguments& a, const OnlineModel& model) {
  std::vector<std::filesystem::path> files;
  if (!a.series.empty()) {
    files.push_back(a.series);
    if (model.kinematic && !is_stream(a.series)) {
      files.push_back(kinematic_series(a.series));
    }
    if (a.layouts) {
      for (std::filesystem::path& file : layout_files(a.series)) {
        files.push_back(std::move(file));
      }
    }
  }
  return files;
}

// Returns the files that were written.
std::vector<std::filesystem::path> write_all_series(const Arguments& a, logs::RecordedLog& log,
                                                    const OnlineModel& model, bool kinematic) {
  const double origin = log.report().files.front().time_origin;
  std::vector<Series> series = {write_series(a.series, log, model, a.detector, origin)};
  if (kinematic && is_stream(a.series)) {
    tell(
        "wheelwright detect: {}: a stream, which takes the torque residual alone: expected a file for both residuals\n",
        a.series.string());
  } else if (kinematic) {
    series.push_back(write_series(kinematic_series(a.series), log, *model.kinematic, a.detector, origin));
  }
  std::vector<std::filesystem::path> written;
  for (const Series& each : series) {
    written.push_back(each.path);
  }
  if (a.layouts) {
    const std::vector<std::filesystem::path> files = layout_files(a.series);
    files::atomic_write(files[0], plotjuggler_layout(series));
    files::atomic_write(files[1], foxglove_layout(series));
    written.insert(written.end(), files.begin(), files.end());
  }
  return written;
}

// Options that do not go together.
void check_together(const Arguments& a) {
  if (a.follow) {
    if (!a.log.empty()) {
      throw InputError("detect: " + a.log.string() +
                       ": a LOG beside --follow, which reads standard input: expected one of them");
    }
    if (!a.series.empty() || a.layouts) {
      throw InputError(std::string(a.layouts ? "--layouts" : "--series") +
                       ": expected a LOG instead of --follow, which tells events alone");
    }
    return;
  }
  if (a.heartbeat > 0.0) {
    throw InputError("--heartbeat: expected --follow, which it is of");
  }
  if (a.log.empty()) {
    throw InputError("detect: expected a LOG, or --follow to read rows from standard input");
  }
  if (a.layouts && (a.series.empty() || is_stream(a.series))) {
    throw InputError("--layouts: expected --series FILE, which they show" +
                     std::string(a.series.empty() ? "" : " and stand beside"));
  }
}

int follow_input(const Arguments& a, const OnlineModel& model, TorqueDetector detector,
                 const logs::LogOptions& reader) {
  FollowOptions how{.json = a.common.json, .heartbeat = a.heartbeat, .events = {}, .fresh = a.common.force};
  if (!a.common.out.empty()) {
    make_directory(a.common);
    how.events = a.common.out / "events.jsonl";
    keep_inputs(how.events, a.common.read);
    keep_existing(a.common, how.events, kEventsSchema);
  }
  return follow(STDIN_FILENO, std::move(detector), model, a.detector, reader, how);
}

OnlineModel decided_model(const Arguments& a) {
  OnlineModel model = read_model(a.model);
  if (a.detector.residual == detector::Residual::d2 && !model.constant) {
    throw InputError("--residual d2: " + a.model.string() +
                     " has no constant thresholds: expected a model commissioned from a log of ten blocks as long as "
                     "the filter's memory at least, or with `thresholds` of all outputs in the robot file");
  }
  return detector::decided_by(std::move(model), a.detector.residual);
}

int run(const Arguments& a) {
  check_together(a);
  OnlineModel model = decided_model(a);
  model.persistence = a.persistence.value_or(model.persistence);
  if (model.kinematic) {
    model.kinematic->persistence = a.persistence.value_or(model.kinematic->persistence);
  }
  Detector detector = make_detector(model, a.detector);
  logs::LogOptions reader = reader_options(a.common);
  reader.leaps = true;  // of a sensor that fails
  reader.only = robots::useful_columns(model.robot);
  reader.heading_offset = model.robot.heading_offset;
  reader.clock = model.robot.clock;
  if (a.follow) {
    return follow_input(a, model, std::move(detector), reader);
  }
  for (const std::filesystem::path& file : series_files(a, model)) {
    keep_inputs(file, a.common.read);
    keep_existing(a.common, file);
    leave_standard_output(a.common, file);
  }
  make_directory(a.common, {"detection.json"});
  const auto opened = logs::open_log({a.log}, reader);
  logs::RecordedLog& log = *opened;
  const report::ReportContext context = report_context(a.common, log.report(), log);
  commission::DetectionOptions watch;
  if (!a.common.out.empty()) {
    watch.most_points = report::most_chart_points;
  }
  const Detection detection = or_failure_page(a.common, context, [&] {
    logs::require_columns(log, model.measurement.columns());
    return detect(log, std::move(detector), watch);
  });
  const commission::KinematicWatch kinematic = commission::watch_kinematics(log, model, a.detector, watch);
  const commission::RiskWatch at_risk =
      commission::watch_at_risk(log, model, static_cast<std::size_t>(std::max(a.common.threads, 1)));
  commission::EventIsolationOptions isolation;
  isolation.isolation.threads = static_cast<std::size_t>(std::max(a.common.threads, 1));
  std::vector<detector::Isolation> isolations;
  std::vector<detector::Incident> incidents;
  const bool proves = a.detector.residual == detector::Residual::d1;  // isolation stands on bounds
  if (proves) {
    isolations = commission::isolate_events(log, model, detection, isolation);
    incidents = commission::join_events(log, model, detection, isolations, kinematic, isolation);
    commission::explain_courses(log, model, detection, kinematic, incidents, isolation.isolation.threads);
  }
  const bool asked =
      proves && (!detection.events.empty() || (kinematic.detection && !kinematic.detection->events.empty()));
  const std::optional<commission::OtherParameters> other =
      asked ? commission::explained_by_other_parameters(log, model, detection, kinematic) : std::nullopt;
  const bool fault = !detection.events.empty() || !at_risk.events.empty() ||
                     (kinematic.detection && !kinematic.detection->events.empty());
  const logs::LogReport& read = log.report();
  const std::string undecided =
      why_not_decided(detection, model, read.rows, log.median_step(), read.rows_read, logs::sentences(read));
  const double share = undecided_share(detection, model, log.median_step(), read.rows_read);
  if (!a.common.out.empty() || a.common.json) {
    Json json = results::to_json(detection, model, a.model.string(), a.log.string(), results::software());
    results::add_isolation(json, isolations);
    results::add_kinematic(json, kinematic, model);
    results::add_at_risk(json, at_risk, model);
    if (proves) {
      results::add_incidents(json, incidents);
    }
    if (asked) {
      results::add_other_parameters(json, other);
    }
    results::add_undecided(json, undecided, share);
    std::string page;
    if (!a.common.out.empty()) {
      page = report::detect_report(detection, model, context,
                                   {.detection = kinematic.detection, .message = kinematic.message}, isolations,
                                   at_risk, incidents, undecided, other ? &*other : nullptr);
    }
    publish(a.common, json, "detection.json", page);
  }
  std::vector<std::filesystem::path> series;
  if (!a.series.empty()) {
    series = write_all_series(a, log, model, kinematic.detection.has_value());
  }
  if (!a.common.quiet && !a.common.json) {
    print_log(logs::sentences(log.report()));
    say_lines(summary(other) +
              summary(incidents, [&](double t) { return logs::clock_time(log.report().files.front(), t); }) +
              summary(detection, model) + summary(at_risk, model) + summary(kinematic, model));
    if (share > 0.0 && undecided.empty()) {
      say("not watched: {:.0f} % of the {} rows could not be decided on\n", 100.0 * share, log.report().rows_read);
    }
    if (!a.common.out.empty()) {
      say("wrote {} and {}\n", (a.common.out / "detection.json").string(), (a.common.out / "report.html").string());
    }
    for (const std::filesystem::path& file : series) {
      say("wrote {}\n", file.string());
    }
  }
  if (!undecided.empty()) {
    tell("wheelwright detect: {}: {}\n", a.log.string(), undecided);
  }
  return fault ? kNo : undecided.empty() ? kDone : kBadInput;
}

}  // namespace
}  // namespace detect_command

Run add_detect(CLI::App& program) {
  using namespace detect_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("detect", kHelp);
  command.add_option("LOG", a->log, "Log (CSV also .gz and .zst, rosbag2, HDF5)");
  command.add_option("--model", a->model, "model.json of `wheelwright commission`")->required()->type_name("FILE");
  command.add_flag("--follow", a->follow, "Read CSV rows from standard input as they come, tell events at once");
  command
      .add_option("--heartbeat", a->heartbeat,
                  "With --follow: say every S seconds of the rows' time that it is watching; 0: never")
      ->transform(in_unit("s"))
      ->type_name("S")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command
      .add_option(
          "--series", a->series,
          "Write residual, thresholds and decisions over time into FILE (.csv, .mcap, .db3, .h5), for PlotJuggler, "
          "Foxglove and the like; those of the kinematic residual into a second file, FILE with _kinematic in its name")
      ->type_name("FILE");
  command.add_flag("--layouts", a->layouts,
                   "Write layouts of PlotJuggler and Foxglove that show the --series, beside it (FILE.plotjuggler.xml, "
                   "FILE.foxglove.json)");
  add_residual(command, a->detector.residual);
  add_set(command, a->detector.set);
  add_test(command, a->detector.test);
  add_persistence(command, a->persistence, "the model's");
  add_map(command, a->common);
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <iostream>
#include <memory>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include <wheelwright/commission/trace.hpp>
#include <wheelwright/io/model_file.hpp>
#include <wheelwright/report/detect_report.hpp>

#include "commands.hpp"
#include "common.hpp"
#include "follow.hpp"
#include "summary.hpp"

namespace wheelwright::app {
namespace {

struct Arguments {
  std::filesystem::path log;
  std::filesystem::path model;
  bool follow = false;
  DetectorOptions detector;
  std::optional<Persistence> persistence;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Looks for faults in a log with a commissioned model: the residual of filtered torque against the threshold that "
    "no "
    "fault-free robot within its bounds can exceed, and where the log has a pose or a gyro, wheel odometry against it.";

constexpr const char* kExamples =
    "Examples:\n"
    "  wheelwright detect drive.csv --model result/model.json --out check\n"
    "  robot_driver | wheelwright detect --follow --model result/model.json\n\n"
    "Exit code: 0 no fault, 1 a fault was found, 2 bad input.";

// The kinematic residual, where model and log have it; else why not.
KinematicWatch watch_kinematics(LogSource& log, const CommissionedModel& model, const DetectorOptions& options) {
  if (!model.kinematic) {
    return {std::nullopt, "the log that the model was commissioned on had neither a usable pose nor a gyro"};
  }
  std::string missing;
  for (const std::string& name : model.kinematic->measurement.columns()) {
    if (!log.find(name)) {
      missing += (missing.empty() ? "" : ", ") + name;
    }
  }
  if (!missing.empty()) {
    return {std::nullopt, "the log has no " + missing};
  }
  return {detect(log, make_detector(*model.kinematic, options)), {}};
}

int run(const Arguments& a) {
  CommissionedModel model = read_model(a.model);
  model.persistence = a.persistence.value_or(model.persistence);
  if (model.kinematic) {
    model.kinematic->persistence = a.persistence.value_or(model.kinematic->persistence);
  }
  Detector detector = make_detector(model, a.detector);
  CsvOptions reader = reader_options(a.common);
  reader.only = useful_columns(model.robot);
  if (a.follow) {
    return follow(std::cin, std::cout, std::move(detector), model, a.detector, reader, a.common.json) ? kNo : kDone;
  }
  if (a.log.empty()) {
    throw InputError("detect: expected a LOG, or --follow to read rows from standard input");
  }
  make_directory(a.common);
  CsvLog log({a.log}, reader);
  require_columns(log, model.measurement.columns());
  const Detection detection = detect(log, std::move(detector));
  const KinematicWatch kinematic = watch_kinematics(log, model, a.detector);
  EventIsolationOptions isolation;
  isolation.isolation.threads = static_cast<std::size_t>(std::max(a.common.threads, 1));
  const std::vector<Isolation> isolations = isolate_events(log, model, detection, isolation);
  const bool fault = !detection.events.empty() || (kinematic.detection && !kinematic.detection->events.empty());
  if (!a.common.out.empty() || a.common.json) {
    Json json = to_json(detection, model, a.model.string(), a.log.string());
    add_isolation(json, isolations);
    add_kinematic(json, kinematic, model);
    std::string page;
    if (!a.common.out.empty()) {
      page = detect_report(detection, model, report_context(a.common, log.report(), log),
                           {.detection = kinematic.detection, .message = kinematic.message}, isolations);
    }
    publish(a.common, json, "detection.json", page);
  }
  if (!a.common.quiet && !a.common.json) {
    for (const std::string& sentence : sentences(log.report())) {
      fmt::print("log: {}\n", sentence);
    }
    fmt::print("{}{}{}", summary(detection, model), summary(isolations, detection), summary(kinematic, model));
    if (!a.common.out.empty()) {
      fmt::print("wrote {} and {}\n", (a.common.out / "detection.json").string(),
                 (a.common.out / "report.html").string());
    }
  }
  return fault ? kNo : kDone;
}

}  // namespace

Run add_detect(CLI::App& program) {
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("detect", kHelp);
  command.add_option("LOG", a->log, "CSV log (also .gz, .zst)");
  command.add_option("--model", a->model, "model.json of `wheelwright commission`")->required()->type_name("FILE");
  command.add_flag("--follow", a->follow, "Read CSV rows from standard input as they come, tell events at once");
  add_set(command, a->detector.set);
  add_test(command, a->detector.test);
  add_persistence(command, a->persistence, "the model's");
  add_common(command, a->common);
  add_map(command, a->common);
  command.footer(kExamples);
  return [a](const std::string& command_line) {
    a->common.command_line = command_line;
    return run(*a);
  };
}

}  // namespace wheelwright::app

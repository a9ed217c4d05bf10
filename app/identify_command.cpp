// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <iterator>
#include <memory>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/log_files.hpp"
#include "app/options.hpp"
#include "app/report_pages.hpp"
#include "app/sound_log.hpp"
#include "commission/identification.hpp"
#include "core/error.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/identification_json.hpp"
#include "results/report/identify_report.hpp"
#include "results/software.hpp"
#include "results/words/identification_summary.hpp"
#include "results/words/identification_words.hpp"

namespace wheelwright::app {
using namespace words;
namespace identify_command {
namespace {

struct Arguments {
  std::vector<std::filesystem::path> logs;
  std::filesystem::path robot;
  bool no_shapes = false;
  CommonOptions common;
};

constexpr const char* kHelp =
    "What a log of fault-free driving says about the robot's parameters, how sure that is, and what to drive next. No "
    "thresholds are made: that is what commission does.\n\n"
    "Noise in the measured speed biases least squares, so the estimator is chosen for the log and the reason told. "
    "Intervals are made by several methods that assume different things; where they agree, they can be believed. A "
    "parameter that the log does not show is named with the manoeuvre that would show it. Delay, lags and a Stribeck "
    "bend are looked for beside the model. A log with a pose (x, y, theta) also gives wheel radii and track width; "
    "without efforts, these only.";

constexpr const char* kExamples =
    "How to drive: speed up and brake, drive curves and change the yaw rate, in both directions, slow and fast, for a "
    "minute or more.\n\n"
    "Examples:\n"
    "  wheelwright identify drive.csv --robot robot.yaml\n"
    "  wheelwright identify drive.csv --robot robot.yaml --out result    # identification.json, report.html\n"
    "  wheelwright identify monday.csv tuesday.csv.gz --robot robot.yaml --json > identification.json\n\n"
    "Exit code: 0 the log shows parameters (or kinematics), 1 it shows none, 2 bad input.";

// Motion of both wheels and a pose, and no effort at all.
bool for_kinematics_only(const LogSource& log, const Robot& robot) {
  const std::vector<std::string> needed = robots::needed_columns(robot);
  const bool effort = std::ranges::any_of(needed, [&](const std::string& name) { return log.find(name).has_value(); });
  return !effort && commission::shows_kinematics(log, robot);
}

int run(const Arguments& a) {
  make_directory(a.common, {"identification.json"});
  Robot robot = read_robot(a.robot);
  const SoundLog opened = open_sound_log(a.logs, robot, a.common, WheelPose::hidden);
  logs::RecordedLog& log = *opened.log;
  robot = model::with_column_errors(opened.robot, logs::interpolation_errors(log.report()));
  if (!for_kinematics_only(log, robot)) {
    try {
      logs::require_columns(log, robots::needed_columns(robot));
    } catch (const InputError& error) {
      if (opened.remarks.empty()) {
        throw;
      }
      throw InputError(fmt::format("{}. {}", error.what(), fmt::join(opened.remarks, " ")));
    }
  }
  report::ReportContext context = report_context(a.common, log.report(), log);
  std::ranges::copy(opened.remarks, std::back_inserter(context.warnings));
  context.seeds = {{"bootstrap and signs", a.common.seed}};
  Progress progress(a.common.quiet);
  commission::IdentificationOptions options;
  options.seed = a.common.seed;
  options.shapes = !a.no_shapes;
  options.progress = [&](std::string_view stage, double share) { progress.tell(stage, share); };
  const commission::Identification result =
      or_failure_page(a.common, context, [&] { return commission::identify(log, robot, options); });
  publish(a.common, results::to_json(result, log.report(), results::software(), a.common.seed), "identification.json",
          report::identify_report(result, context));
  if (!a.common.quiet && !a.common.json) {
    print_log(context.warnings);
    say_lines(summary(result));
    if (!a.common.out.empty()) {
      say("wrote {} and {}\n", (a.common.out / "identification.json").string(),
          (a.common.out / "report.html").string());
    }
  }
  return standing(result) == IdentificationStanding::bad ? kNo : kDone;
}

}  // namespace
}  // namespace identify_command

Run add_identify(CLI::App& program) {
  using namespace identify_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("identify", kHelp);
  command.add_option("LOG", a->logs, "Logs (CSV also .gz and .zst, rosbag2, HDF5); several are taken together")
      ->required();
  command.add_option("--robot", a->robot, "Robot file (YAML)")->required()->type_name("FILE");
  command.add_flag("--no-shapes", a->no_shapes, "Do not look for delay, lags and Stribeck speed");
  add_map(command, a->common);
  add_despite(command, a->common);
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app

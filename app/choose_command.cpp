// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <map>
#include <memory>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/log_files.hpp"
#include "app/options.hpp"
#include "app/report_pages.hpp"
#include "commission/choice/detector_choice.hpp"
#include "core/error.hpp"
#include "formats/logs/recorded_log.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/choice_json.hpp"
#include "results/model_file.hpp"
#include "results/report/choice_report.hpp"
#include "results/software.hpp"
#include "results/words/choice_summary.hpp"

namespace wheelwright::app {
namespace choose_command {
namespace {

struct Arguments {
  std::vector<std::filesystem::path> logs;
  std::filesystem::path robot;
  std::vector<std::string> faults;
  commission::DetectorChoiceOptions choice;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Chooses the filter's order, α and β and the decision rule for the faults that are to be seen, under a stated "
    "promise about false alarms, and says what every other choice costs.";

constexpr const char* kExamples =
    "Every candidate is commissioned on LOG and asked, for the motion of LOG, from what size on a fault is certain to "
    "be\n"
    "seen within the window (median over onsets while moving) and how soon a fault of the stated SIZE is. With --out,\n"
    "model.json is the chosen detector, ready for `wheelwright detect`; choice.json has all candidates.\n\n"
    "Examples:\n"
    "  wheelwright choose drive.csv --robot robot.yaml --out choice\n"
    "  wheelwright choose drive.csv --robot robot.yaml --fault wheel_radius=0.05 --fault payload_lost=2 --window 0.5\n"
    "  wheelwright choose drive.csv --robot robot.yaml --false-alarms 1e-3\n\n"
    "Exit code: 0 a detector was chosen, 1 no candidate is certain to see a stated fault, 2 bad input.";

commission::StatedFault stated(const std::string& text) {
  const std::size_t at = text.find('=');
  commission::StatedFault fault{text.substr(0, at)};
  if (at != std::string::npos) {
    double size = 0.0;
    const char* const end = text.data() + text.size();
    const auto read = std::from_chars(text.data() + at + 1, end, size);
    if (read.ec != std::errc() || read.ptr != end || !(size > 0.0) || !std::isfinite(size)) {
      throw InputError("--fault '" + text + "': expected NAME or NAME=SIZE with a SIZE > 0, e.g. wheel_radius=0.05");
    }
    fault.size = size;
  }
  return fault;
}

int run(const Arguments& a) {
  commission::DetectorChoiceOptions options = a.choice;
  for (const std::string& text : a.faults) {
    options.trial.faults.push_back(stated(text));
  }
  make_directory(a.common, {"choice.json", "model.json"});
  Robot robot = read_robot(a.robot);
  const auto opened = open_robot_log(a.logs, robot, a.common);
  logs::RecordedLog& log = *opened;
  robot = model::with_column_errors(robot, logs::interpolation_errors(log.report()));
  logs::require_columns(log, robots::needed_columns(robot));
  Progress progress(a.common.quiet);
  options.trial.threads = static_cast<std::size_t>(a.common.threads);
  options.progress = [&](std::string_view stage, double share) { progress.tell(stage, share); };
  const commission::DetectorChoice choice = commission::choose_detector(log, robot, options);

  std::vector<std::string> logs;
  for (const auto& path : a.logs) {
    logs.push_back(path.string());
  }
  const Json json = results::to_json(choice, a.robot.string(), logs, results::software());
  if (!a.common.out.empty()) {
    CommonOptions files = a.common;
    files.json = false;
    if (choice.chosen) {
      report::CommissionContext context{report_context(a.common, log.report(), log)};
      context.seen = commission::first_look(log, choice.chosen->model, options.trial.threads);
      files::write_json(gathered(a.common) / "choice.json", json);
      publish(files, results::to_json(*choice.chosen, log.report(), results::software()), "model.json",
              report::choice_report(choice, context));
    } else {
      publish(files, json, "choice.json", "");
    }
  }
  if (a.common.json) {
    say_json(json);
  } else if (!a.common.quiet) {
    say_lines(words::summary(choice, choice.chosen ? results::robot_file_line(choice.candidates.front().filter) : ""));
  }
  return choice.chosen ? kDone : kNo;
}

}  // namespace
}  // namespace choose_command

Run add_choose(CLI::App& program) {
  using namespace choose_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("choose", kHelp);
  command.add_option("LOG", a->logs, "Logs of fault-free driving (CSV, rosbag2, HDF5); several are taken together")
      ->required();
  command.add_option("--robot", a->robot, "Robot file (YAML)")->required()->type_name("FILE");
  command
      .add_option(
          "--fault", a->faults,
          "A fault of the catalogue that is to be seen, and its size (may be repeated; default: wheel_radius and "
          "wheel_radius_right of 20 %)")
      ->allow_extra_args(false)
      ->type_name("NAME=SIZE");
  command.add_option("--window", a->choice.trial.window, "Time after the onset in which it is to be seen, s")
      ->transform(in_unit("s"))
      ->type_name("S")
      ->check(CLI::Range(1e-3, 3600.0))
      ->capture_default_str();
  command
      .add_option("--false-alarms", a->choice.trial.false_alarms,
                  "Probability of a false alarm in an hour that is allowed; 0: never within the declared noise")
      ->type_name("P")
      ->check(CLI::Range(0.0, 0.5))
      ->capture_default_str();
  command
      .add_option(
          "--guarantee", a->choice.either,
          "Which certain sizes candidates are compared by: those for every-noise within its bounds, or either, by "
          "whichever guarantee sees a fault first (docs/methods/risk.md); both are told")
      ->transform(CLI::CheckedTransformer(std::map<std::string, bool>{{"every-noise", false}, {"either", true}})
                      .description("{every-noise,either}"))
      ->default_str("every-noise")
      ->type_name("WHICH");
  add_map(command, a->common);
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app

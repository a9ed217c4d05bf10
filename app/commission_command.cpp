// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdio>
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
#include "commission/commission.hpp"
#include "commission/two_walks.hpp"
#include "commission/watch/detector_walk.hpp"
#include "detector/online_model.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/model_file.hpp"
#include "results/report/commission_report.hpp"
#include "results/report/page.hpp"
#include "results/software.hpp"
#include "results/words/commission_summary.hpp"

namespace wheelwright::app {
using namespace words;
namespace commission_command {
namespace {

struct Arguments {
  std::vector<std::filesystem::path> logs;
  std::filesystem::path robot;
  bool statistical = false;
  std::size_t outliers = 0;
  std::optional<detector::Persistence> persistence;
  CommonOptions common;
};

constexpr const char* kHelp =
    "From a log of fault-free driving to a model that a detector can carry: best-guess parameters by least squares on "
    "filtered torque, bounds on them (guaranteed where the robot file declares its sensors' noise, else extrapolated), "
    "thresholds, and a trial on driving that was held out.\n\n"
    "Drive so that every parameter shows: speed up and brake, drive curves and change the yaw rate, in both "
    "directions, for a minute or more.";

constexpr const char* kExamples =
    "Examples:\n"
    "  wheelwright commission drive.csv --robot robot.yaml --out result\n"
    "  wheelwright commission monday.csv tuesday.csv.gz --robot robot.yaml --out result\n"
    "  wheelwright commission drive.csv --robot robot.yaml --map omega_r=wheel_2 --json > model.json\n\n"
    "Exit code: 0 a model was made, 1 the log contradicts the model or shows no parameter, 2 bad input.";

int run(const Arguments& a) {
  make_directory(a.common, {"model.json"});
  Robot robot = read_robot(a.robot);
  const SoundLog opened = open_sound_log(a.logs, robot, a.common, WheelPose::judged);
  logs::RecordedLog& log = *opened.log;
  robot = model::with_column_errors(opened.robot, logs::interpolation_errors(log.report()));
  report::CommissionContext context{report_context(a.common, log.report(), log)};
  std::ranges::copy(opened.remarks, std::back_inserter(context.warnings));
  Progress progress(a.common.quiet);
  commission::CommissionOptions options;
  options.noise_mode = a.statistical ? filter::NoiseMode::statistical : filter::NoiseMode::worst_case;
  options.outliers = a.outliers;
  options.persistence = a.persistence.value_or(detector::Persistence{});
  options.threads = static_cast<std::size_t>(a.common.threads);
  options.progress = [&](std::string_view stage, double share) { progress.tell(stage, share); };
  const Commissioning result = or_failure_page(a.common, context, [&] {
    logs::require_columns(log, robots::needed_columns(robot));
    Commissioning found = commission_robot(log, robot, options);
    if (!found.model.facets.empty() && !a.common.out.empty()) {
      commission::two_walks(
          log, options.threads,
          [&](LogSource& walk) {
            context.own_log = detect(walk, make_detector(found.model), {.most_points = report::most_chart_points});
          },
          [&](LogSource& walk) { context.seen = commission::first_look(walk, found.model); });
    }
    return found;
  });
  Json model = results::to_json(result, log.report(), results::software());
  if (!a.common.columns.empty()) {
    model["robot"]["columns"] = a.common.columns;
  }
  publish(a.common, model, "model.json", report::commission_report(result, context));
  if (!a.common.quiet && !a.common.json) {
    print_log(context.warnings);
    say_lines(summary(result));
    if (!a.common.out.empty()) {
      say("wrote {} and {}\n", (a.common.out / "model.json").string(), (a.common.out / "report.html").string());
    }
  }
  return result.model.facets.empty() ? kNo : kDone;
}

}  // namespace
}  // namespace commission_command

Run add_commission(CLI::App& program) {
  using namespace commission_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("commission", kHelp);
  command.add_option("LOG", a->logs, "Logs (CSV also .gz and .zst, rosbag2, HDF5); several are taken together")
      ->required();
  command.add_option("--robot", a->robot, "Robot file (YAML)")->required()->type_name("FILE");
  command.add_flag("--statistical", a->statistical,
                   "Propagate declared sensor noise at a confidence of 99.9 % instead of in the worst case");
  command.add_option("--outliers", a->outliers, "Let the feasible set leave out at most N instants")
      ->type_name("N")
      ->capture_default_str();
  add_persistence(command, a->persistence, "1/1");
  add_map(command, a->common);
  add_despite(command, a->common);
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app

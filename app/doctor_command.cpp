// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/log_files.hpp"
#include "app/options.hpp"
#include "app/report_pages.hpp"
#include "commission/doctor/log_health.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/health_json.hpp"
#include "results/report/health_report.hpp"
#include "results/software.hpp"
#include "results/words/health_summary.hpp"

namespace wheelwright::app {
namespace doctor_command {
namespace {

struct Arguments {
  std::vector<std::filesystem::path> logs;
  std::filesystem::path robot;
  std::size_t most_rows = 1000000;
  bool all = false;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Says what a log lacks before anything is made of it: rates, gaps and clocks, stuck, stale, coarse or limited "
    "signals, rest, which manoeuvres are missing, and units, signs and sides that do not fit each other. Each finding "
    "says what to do next.\n\n"
    "Without a robot file the kind of robot is guessed from the columns, and scales (radius, track, mass) cannot be "
    "checked.";

constexpr const char* kExamples =
    "Examples:\n"
    "  wheelwright doctor drive.csv\n"
    "  wheelwright doctor drive.csv --robot robot.yaml --out examined    # doctor.json, report.html\n"
    "  wheelwright doctor drive.csv --robot robot.yaml --all             # also what is as it should be\n\n"
    "Exit code: 0 the log can be commissioned, 1 it cannot or should not be as it stands, 2 bad input.";

int run(const Arguments& a) {
  make_directory(a.common, {"doctor.json"});
  const std::optional<Robot> robot = a.robot.empty() ? std::nullopt : std::optional(read_robot(a.robot));
  const auto opened = logs::open_log(a.logs, robot ? robot_reader(*robot, a.common) : reader_options(a.common));
  logs::RecordedLog& log = *opened;
  const doctor::LogHealth health =
      results::examine_first(log, robot, a.most_rows, static_cast<std::size_t>(a.common.threads));
  if (!a.common.out.empty() || a.common.json) {
    results::HealthFiles files{a.robot.string(), {}, results::software()};
    for (const std::filesystem::path& path : a.logs) {
      files.logs.push_back(path.string());
    }
    publish(a.common, results::to_json(health, files), "doctor.json",
            report::health_report(health, report_context(a.common, log.report(), log)));
  }
  if (!a.common.quiet && !a.common.json) {
    print_log(logs::sentences(log.report()));
    say_lines(words::summary(health, a.all, [&](double t) { return logs::clock_time(log.report().files.front(), t); }));
    if (!a.common.out.empty()) {
      say("wrote {} and {}\n", (a.common.out / "doctor.json").string(), (a.common.out / "report.html").string());
    }
  }
  return health.verdict == doctor::LogVerdict::commission ? kDone : kNo;
}

}  // namespace
}  // namespace doctor_command

Run add_doctor(CLI::App& program) {
  using namespace doctor_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("doctor", kHelp);
  command.add_option("LOG", a->logs, "Logs (CSV also .gz and .zst, rosbag2, HDF5); several are taken together")
      ->required();
  command.add_option("--robot", a->robot, "Robot file (YAML): scales of units and its own model are checked too")
      ->type_name("FILE");
  command.add_flag("--all", a->all, "Show what is as it should be, too");
  command.add_option("--rows", a->most_rows, "Look at the first N rows")
      ->type_name("N")
      ->check(CLI::Range(std::size_t{1}, std::size_t{1000000000}))
      ->capture_default_str();
  add_map(command, a->common);
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app

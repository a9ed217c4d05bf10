// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/log_files.hpp"
#include "app/options.hpp"
#include "app/run_items.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"
#include "formats/robots/fleet_list.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/fleet_json.hpp"
#include "results/fleet_logs.hpp"
#include "results/report/fleet_report.hpp"
#include "results/software.hpp"
#include "results/words/fleet_summary.hpp"
#include "study/examine_robot.hpp"
#include "study/fleet_result.hpp"

namespace wheelwright::app {
namespace fleet_command {
namespace {

struct Arguments {
  std::filesystem::path list, robot;
  bool statistical = false;
  study::FleetOptions judge;
  ScaleOptions scale;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Commissions and checks the logs of many robots: which robots stand outside the others, which drift, which logs "
    "raise alarms, and a prior that makes the next robot's bounds tighter, with a stated coverage. A bad log never "
    "stops the rest, and a run that was killed goes on where it was.";

constexpr const char* kExamples =
    "LIST is a directory, or a CSV file with the header robot,log and any of when, robot_file, role:\n\n"
    "  robot,log,when,role\n"
    "  amy,amy/monday.csv,2026-03-02,commission\n"
    "  amy,amy/friday.csv,2026-03-06,check\n"
    "  bob,bob.mcap,2026-03-02,\n\n"
    "Paths are relative to the list; when is a date or a number of days; without a role the earliest log of a robot\n"
    "commissions and the later ones are checked. In a directory each directory is a robot (with its own robot.yaml,\n"
    "where it has one), and each log beside those is a robot of its own.\n\n"
    "Results: fleet.json, fleet.csv (a row for each robot and parameter), pooled_prior.yaml (to copy into the next\n"
    "robot's file) and report.html. What was examined is kept in results.sqlite: run again to go on, or when logs "
    "were\n"
    "added or changed; only those are examined.\n\n"
    "Examples:\n"
    "  wheelwright fleet fleet.csv --robot robot.yaml --out result --threads 8\n"
    "  wheelwright fleet logs --robot robot.yaml --out result --coverage 0.9\n"
    "  mpirun wheelwright fleet fleet.csv --robot robot.yaml --out result\n"
    "  wheelwright fleet fleet.csv --robot robot.yaml --out result --shard 1/10     (and 2/10 … 10/10, anywhere)\n"
    "  wheelwright fleet fleet.csv --robot robot.yaml --out result --merge\n\n"
    "Exit code: 0 all is well, 1 a robot stands outside, drifts, raised an alarm, contradicts its model or could not "
    "be\nexamined (the report lists which), 2 bad usage or no such list.";

results::StoredPlan plan_of(const Arguments& a, const std::optional<Robot>& fleet) {
  results::StoredPlan plan = {{"fleet format", results::kFleetSchema},
                              {"--robot", fleet ? files::json_text(robots::to_json(*fleet), -1) : std::string("none")},
                              {"--statistical", a.statistical ? "yes" : "no"}};
  std::string maps;
  for (const std::string& map : a.common.map) {
    maps += map + " ";
  }
  plan.emplace_back("--map", maps);
  plan.emplace_back("--despite", fmt::format("{}", fmt::join(a.common.despite, " ")));
  return plan;
}

const std::vector<std::string> kWritten = {"fleet.json", "fleet.csv", "pooled_prior.yaml"};

// Whether a robot of a directory of logs is nothing but --out, or a result of this command in it.
bool is_result(const robots::FleetListRobot& robot, const Arguments& a) {
  std::error_code neither;
  std::vector<robots::FleetListLog> logs = robot.commission;
  logs.insert(logs.end(), robot.checks.begin(), robot.checks.end());
  const bool own = std::ranges::all_of(logs, [&](const robots::FleetListLog& log) {
    return std::filesystem::equivalent(log.path.parent_path(), a.common.out, neither) &&
           std::ranges::find(kWritten, log.path.filename().string()) != kWritten.end();
  });
  const bool out = std::filesystem::equivalent(a.list / robot.name, a.common.out, neither);
  if (out && !own) {
    throw InputError(fmt::format("--out {}: holds logs of the robot {}: expected another directory",
                                 a.common.out.string(), files::shown(robot.name)));
  }
  if (own && !logs.empty() && !a.common.quiet && !launched_by_mpi()) {
    tell("wheelwright fleet: {}: left out: a result of this command, no log\n", logs.front().path.string());
  }
  return own && (out || !logs.empty());
}

// The robots of LIST, without what an earlier run wrote among their logs. Throws InputError where a result would
// replace a file of theirs.
std::vector<robots::FleetListRobot> robots_of(const Arguments& a) {
  std::vector<robots::FleetListRobot> robots = robots::read_fleet(a.list);
  if (!a.common.out.empty() && std::filesystem::is_directory(a.list)) {
    std::erase_if(robots, [&](const robots::FleetListRobot& robot) { return is_result(robot, a); });
    if (robots.empty()) {
      throw InputError(a.list.string() + ": no log and no directory with logs in it but --out: expected a robot");
    }
  }
  std::vector<std::filesystem::path> read;
  for (const robots::FleetListRobot& robot : robots) {
    for (const robots::FileState& file : robots::states_of(robot)) {
      read.push_back(file.path);
    }
  }
  keep_inputs(a.common, kWritten, read);
  return robots;
}

// Reads the records in the order of items: the fleet, and fleet.csv on the way.
study::FleetResult gather(results::SqliteResults& results, const Arguments& a) {
  study::FleetResult fleet;
  std::optional<files::AtomicFile> csv;
  if (!a.common.out.empty()) {
    csv.emplace(gathered(a.common) / "fleet.csv");
    csv->write(results::fleet_csv_header());
  }
  results.each([&](std::size_t item, std::string_view text) {
    const study::RobotRecord record =
        results::record_from_text(text, fmt::format("{}: item {}", results.file().string(), item));
    study::take(fleet, record);
    if (csv) {
      csv->write(results::fleet_csv_rows(record));
    }
  });
  if (csv) {
    csv->commit();
  }
  study::FleetOptions options = a.judge;
  options.prior.seed = a.common.seed;
  options.drift_level = a.judge.population.level;
  study::judge_fleet(fleet, options);
  return fleet;
}

// What makes the page again. How the work was shared out is left out: the page does not depend on it.
std::string command_of(const Arguments& a) {
  std::string out = "wheelwright fleet " + a.list.string();
  out += a.robot.empty() ? "" : " --robot " + a.robot.string();
  out += fmt::format(" --level {} --coverage {} --seed {}", a.judge.population.level, a.judge.prior.coverage,
                     a.common.seed);
  out += a.statistical ? " --statistical" : "";
  for (const std::string& map : a.common.map) {
    out += " --map " + map;
  }
  for (const std::string& name : a.common.despite) {
    out += " --despite " + name;
  }
  return out + " --out DIR";
}

/// The files of robots as they were when first asked for: a result belongs to these. A shard asks for its own alone.
/// For several threads at once.
class FirstFiles {
 public:
  explicit FirstFiles(const std::vector<robots::FleetListRobot>& robots) : robots_(robots), first_(robots.size()) {}

  const std::string& key(std::size_t item) { return first(item).key; }

  /// Those that are others now.
  std::vector<std::string> changed(std::size_t item) {
    const std::vector<std::uint64_t>& before = first(item).states;
    std::vector<std::string> names;
    std::size_t k = 0;
    for (const auto& [path, state] : robots::states_of(robots_[item])) {
      if (state != before[k++]) {
        names.push_back(path.string());
      }
    }
    return names;
  }

 private:
  struct Files {
    std::vector<std::uint64_t> states;
    std::string key;
  };

  const Files& first(std::size_t item) {
    const std::scoped_lock guard(mutex_);
    Files& files = first_[item];
    if (files.key.empty()) {
      for (const robots::FileState& file : robots::states_of(robots_[item])) {
        files.states.push_back(file.state);
      }
      files.key = robots::key_of(robots_[item]);
    }
    return files;
  }

  const std::vector<robots::FleetListRobot>& robots_;
  std::mutex mutex_;
  std::vector<Files> first_;
};

std::string name_and_paths(const robots::FleetListRobot& robot) {
  std::string text = fmt::format("{}\n{}", robot.name, robot.robot_file.string());
  for (const auto* const logs : {&robot.commission, &robot.checks}) {
    text += "\nlogs";
    for (const robots::FleetListLog& log : *logs) {
      text += fmt::format("\n{} {}", log.path.string(), log.when);
    }
  }
  return text;
}

// What is said of a robot whose files changed while they were read: nothing that was read of them.
study::RobotRecord record_of_changed(study::RobotLogs logs, const std::vector<std::string>& files) {
  const auto refuse = [&]() -> study::OpenedLog {
    throw InputError(
        fmt::format("{}: written to while the robot was examined: expected files that are complete; the "
                    "next run examines it again",
                    core::listed(files)));
  };
  logs.commissioning.open = refuse;
  for (study::FleetLog& check : logs.checks) {
    check.open = refuse;
  }
  study::RobotRecord record = study::examine_robot(logs);
  record.passing = true;
  return record;
}

int run(const Arguments& a) {
  const std::vector<robots::FleetListRobot> robots = robots_of(a);
  make_directory(a.common, kWritten, lock_for(a.scale));
  const std::optional<Robot> own = a.robot.empty() ? std::nullopt : std::optional(read_robot(a.robot));
  CommonOptions given = a.common;
  given.columns.clear();
  const results::FleetReading reading{own, a.common.columns, reader_options(given), a.common.despite};
  study::ExamineOptions examine;
  examine.commission.at_risk = commission::CommissionOptions::AtRisk::detector;  // no record says what it will see
  examine.commission.noise_mode = a.statistical ? filter::NoiseMode::statistical : filter::NoiseMode::worst_case;
  ItemsToRun items;
  items.work.items = robots.size();
  FirstFiles files(robots);
  items.work.evaluate = [&](std::size_t item) {
    static_cast<void>(files.key(item));  // before they are read
    const study::RobotLogs logs = results::logs_of(robots[item], reading);
    study::RobotRecord record = study::examine_robot(logs, examine);
    if (const std::vector<std::string> changed = files.changed(item); !changed.empty()) {
      record = record_of_changed(logs, changed);
    }
    return results::record_text(record);
  };
  items.key = [&](std::size_t item) { return files.key(item); };
  // Where another process examined the robot, its first look was another one.
  items.passing = [&, ranks = launched_by_mpi()](std::size_t item, std::string_view text) {
    return results::is_passing(text) || (ranks && !files.changed(item).empty());
  };
  items.agreed = [&](std::size_t item) { return name_and_paths(robots[item]); };
  items.plan = plan_of(a, own);
  std::optional<Progress> progress(a.common.quiet);
  const ItemsRun run = run_items(items, a.common, a.scale, [&](std::size_t done, std::size_t all) {
    progress->tell(fmt::format("robot {} of {}", done, all), static_cast<double>(done) / static_cast<double>(all));
  });
  progress.reset();
  if (!run.results) {
    return kDone;
  }
  const study::FleetResult fleet = gather(*run.results, a);
  report::ReportContext context;
  context.software = results::software();
  context.command_line = command_of(a);
  context.log_files = {a.list.string()};
  context.seeds = {{"which robots the pooled prior learns from", a.common.seed}};
  if (!a.common.out.empty()) {
    files::atomic_write(gathered(a.common) / "pooled_prior.yaml",
                        results::pooled_prior_yaml(fleet, results::software()));
  }
  publish(a.common, results::to_json(fleet, a.list.string(), results::software()), "fleet.json",
          a.common.out.empty() ? std::string() : report::fleet_report(fleet, context));
  if (!a.common.quiet && !a.common.json) {
    say_lines(words::summary(fleet));
    if (!a.common.out.empty()) {
      say("wrote fleet.json, fleet.csv, pooled_prior.yaml and report.html to {}\n", a.common.out.string());
    }
  }
  return fleet.well() ? kDone : kNo;
}

}  // namespace
}  // namespace fleet_command

Run add_fleet(CLI::App& program) {
  using namespace fleet_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("fleet", kHelp);
  command.add_option("LIST", a->list, "Directory of logs, or list of robots and logs (CSV)")->required();
  command.add_option("--robot", a->robot, "Robot file (YAML) of every robot that has none of its own")
      ->type_name("FILE");
  command
      .add_option("--level", a->judge.population.level,
                  "Probability that any robot of a fleet of equals is called outside, and that any is said to drift")
      ->type_name("P")
      ->check(CLI::Range(1e-9, 0.5))
      ->capture_default_str();
  command
      .add_option("--coverage", a->judge.prior.coverage,
                  "Probability with which the pooled prior is to hold the next robot")
      ->type_name("P")
      ->check(CLI::Range(0.01, 0.9999))
      ->capture_default_str();
  command.add_flag("--statistical", a->statistical,
                   "Propagate declared sensor noise at a confidence of 99.9 % instead of in the worst case");
  add_scale_options(command, a->scale);
  add_map(command, a->common);
  add_despite(command, a->common);
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app

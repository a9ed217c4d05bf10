// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "formats/files/json.hpp"
#include "formats/logs/log_file.hpp"
#include "model/sim/simulation.hpp"
#include "results/scenario_file.hpp"
#include "results/software.hpp"

namespace wheelwright::app {
namespace simulate_command {
namespace {

struct Arguments {
  std::filesystem::path scenario;
  std::optional<std::uint64_t> seed;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Drives the robot of the paper in closed loop, with bounded sensor noise and with faults that begin when you say, "
    "and writes what its sensors would log.";

constexpr const char* kExamples =
    "Examples:\n"
    "  wheelwright simulate examples/scenarios/commissioning.yaml --out healthy.csv\n"
    "  wheelwright simulate examples/scenarios/wheel_radius_fault.yaml --out fault.csv.gz --seed 7";

int run(const Arguments& a) {
  keep_inputs(a.common.out, {a.scenario});
  keep_existing(a.common, a.common.out);
  leave_standard_output(a.common, a.common.out);
  std::vector<std::filesystem::path> named;
  Scenario scenario = read_scenario(a.scenario, &named);
  keep_inputs(a.common.out, named);
  if (a.seed) {
    scenario.seed = *a.seed;
  }
  Simulation simulation(scenario);
  const auto writer = logs::create_csv(a.common.out, simulation.columns());
  LogBlock block;
  std::size_t rows = 0;
  while (simulation.next(block)) {
    writer->write(block);
    rows += block.rows();
  }
  writer->commit();
  if (a.common.json) {
    say_json({{"schema", "wheelwright/simulation/1"},
              {"software", results::software()},
              {"scenario", a.scenario.string()},
              {"log", a.common.out.string()},
              {"rows", rows},
              {"seed", scenario.seed}});
  } else if (!a.common.quiet) {
    say("wrote {}: {} rows, {:.1f} s, seed {}\n", a.common.out.string(), rows, scenario.duration, scenario.seed);
  }
  return kDone;
}

}  // namespace
}  // namespace simulate_command

Run add_simulate(CLI::App& program) {
  using namespace simulate_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("simulate", kHelp);
  command.add_option("SCENARIO", a->scenario, "Scenario file (YAML)")->required();
  command.add_option("--out", a->common.out, "The log to write: .csv, .csv.gz or .csv.zst")
      ->required()
      ->type_name("LOG");
  command.add_option("--seed", a->seed, "Seed of all noise, in place of the scenario's")->type_name("N");
  command.add_option("--threads", a->common.threads, "Accepted for all commands; a drive is one thread")
      ->type_name("N")
      ->check(CLI::Range(1, 1024));
  command.add_flag("--force", a->common.force, "Replace a log that is there");
  command.add_flag("--json", a->common.json, "Say what was written as JSON");
  command.add_flag("--quiet", a->common.quiet, "Say nothing");
  command.footer(kExamples);
  return [a](const std::string&) { return run(*a); };
}

}  // namespace wheelwright::app

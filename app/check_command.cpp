// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/check_report.hpp"
#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/log_files.hpp"
#include "app/options.hpp"
#include "results/check_words.hpp"
#include "results/model_check.hpp"
#include "results/model_claims.hpp"
#include "results/software.hpp"

namespace wheelwright::app {
namespace check_command {
namespace {

struct Arguments {
  std::filesystem::path model;
  std::vector<std::filesystem::path> logs;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Proves the bounds of a model again, from the log that it was made from: filters the log, rebuilds the rows that "
    "each bound names, and verifies their multipliers in exact rational arithmetic. No solver takes part.\n\n"
    "Checked are the bounds of every parameter (also in physical words), every facet of the feasible set, the same of "
    "wheel radii and yaw gains, or, where the model says that nothing explains the log, that claim. So is what it says "
    "at a stated risk: sums over the log are "
    "taken again, facets and bounds are proved from them, and the parts of the risk are added up. What is proved is "
    "arithmetic, and that the word guaranteed follows from the noise that the robot file declares and from the tests "
    "of "
    "the assumptions. Not checked: estimates, standard errors, validation, and whether the noise, the prior and the "
    "other assumptions that the model states are true; they are listed as given, with what commissioning's tests said.";

constexpr const char* kExamples =
    "Examples:\n"
    "  wheelwright check result/model.json drive.csv\n"
    "  wheelwright check result/model.json monday.csv tuesday.csv.gz --json\n\n"
    "Exit code: 0 everything is proved, 1 something is not (it is said what and by how much), 2 bad input.";

int run(const Arguments& a) {
  make_directory(a.common, {"check.json"});
  const results::ModelClaims claims = results::read_claims(a.model);
  const auto opened = open_robot_log(a.logs, claims.robot, a.common);
  logs::RecordedLog& log = *opened;
  logs::require_columns(log, claims.measurement.columns());
  if (claims.kinematic) {
    logs::require_columns(log, claims.kinematic->model.measurement.columns());
  }
  const results::ModelCheck check = results::check_model(claims, log, log.report());
  results::CheckedFiles files{a.model.string(), {}};
  for (const std::filesystem::path& path : a.logs) {
    files.logs.push_back(path.string());
  }
  if (!a.common.out.empty() || a.common.json) {
    publish(a.common, results::to_json(check, claims, log.report(), files, results::software()), "check.json",
            check_report(check, claims, files, results::software()));
  }
  if (!a.common.quiet && !a.common.json) {
    say_lines(results::check_summary(check, claims));
    if (!a.common.out.empty()) {
      say("wrote {} and {}\n", (a.common.out / "check.json").string(), (a.common.out / "report.html").string());
    }
  }
  return check.proved() ? kDone : kNo;
}

}  // namespace
}  // namespace check_command

Run add_check(CLI::App& program) {
  using namespace check_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("check", kHelp);
  command.add_option("MODEL", a->model, "model.json of `wheelwright commission`")->required();
  command.add_option("LOG", a->logs, "The logs it was commissioned on, in the same order")->required();
  add_map(command, a->common);
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app

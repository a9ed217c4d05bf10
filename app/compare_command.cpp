// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/options.hpp"
#include "commission/model_comparison.hpp"
#include "core/words.hpp"
#include "formats/robots/online_model_file.hpp"
#include "results/comparison_json.hpp"
#include "results/report/comparison_report.hpp"
#include "results/software.hpp"
#include "results/words/comparison_words.hpp"

namespace wheelwright::app {
namespace compare_command {
namespace {

using commission::ModelComparison;
using results::ComparedModel;

struct Arguments {
  std::filesystem::path before, after;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Compares two commissioned models: what has changed for certain between their logs, which parameters alone explain "
    "it, and what could have changed unseen. Before and after a repair, a winter or a new load; or two robots of one "
    "kind.\n\n"
    "Each model has the set of all parameters that its log allows. Where no one robot is in both, something has "
    "changed, even where the intervals of every parameter overlap. Where nothing is certain, best guesses that differ "
    "by more than chance are told, and called that.";

constexpr const char* kExamples =
    "Examples:\n"
    "  wheelwright compare january/model.json june/model.json --out wear\n"
    "  wheelwright compare robot_3/model.json robot_7/model.json\n\n"
    "Exit code: 0 no change is told, 1 something has changed (for certain, or by statistics), 2 bad input, or models "
    "that do not compare.";

std::string logs_of(const ComparedModel& model) {
  std::vector<std::string> logs;
  for (const Json& log : model.logs) {
    logs.push_back(fmt::format("{} ({})", log.at("path").get<std::string>(), log.at("hash").get<std::string>()));
  }
  return fmt::format("{}: {}; {}", model.robot, model.file, logs.empty() ? "its log is not told" : core::listed(logs));
}

std::vector<std::string> remarks(const ComparedModel& before, const ComparedModel& after) {
  std::vector<std::string> out;
  if (!before.logs.empty() && before.logs == after.logs) {
    out.emplace_back("Both models were made from the same log: what differs is how it was commissioned.");
  }
  if (before.robot != after.robot) {
    out.push_back(fmt::format("The robots have different names, {} and {}: what is called a change is a difference.",
                              before.robot, after.robot));
  }
  return out;
}

int run(const Arguments& a) {
  make_directory(a.common, {"comparison.json"});
  const ComparedModel before = results::compared_model(a.before.string());
  const ComparedModel after = results::compared_model(a.after.string());
  const ModelComparison comparison = [&] {
    const OnlineModel first = read_model(a.before), second = read_model(a.after);
    try {
      return commission::compare_models(first, second, before.guesses, after.guesses);
    } catch (const InvalidArgument& error) {
      throw InputError(fmt::format("{} and {}: {}", a.before.string(), a.after.string(), error.what()));
    }
  }();
  if (!a.common.out.empty() || a.common.json) {
    publish(
        a.common, results::to_json(comparison, before, after, results::software()), "comparison.json",
        report::comparison_report(
            comparison, {.title = before.robot == after.robot ? before.robot + ", before and after"
                                                              : fmt::format("{} against {}", after.robot, before.robot),
                         .before = logs_of(before),
                         .after = logs_of(after),
                         .remarks = remarks(before, after),
                         .software = results::software()}));
  }
  if (!a.common.quiet && !a.common.json) {
    say("before: {}\nafter:  {}\n", logs_of(before), logs_of(after));
    for (const std::string& remark : remarks(before, after)) {
      say("{}\n", remark);
    }
    say_lines(words::summary(comparison));
    if (!a.common.out.empty()) {
      say("wrote {} and {}\n", (a.common.out / "comparison.json").string(), (a.common.out / "report.html").string());
    }
  }
  return comparison.changed() || !comparison.likely().empty() ? kNo : kDone;
}

}  // namespace
}  // namespace compare_command

Run add_compare(CLI::App& program) {
  using namespace compare_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("compare", kHelp);
  command.add_option("BEFORE", a->before, "model.json of `wheelwright commission`")->required();
  command.add_option("AFTER", a->after, "model.json of a later log, or of another robot")->required();
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app

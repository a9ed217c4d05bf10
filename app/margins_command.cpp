// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/log_files.hpp"
#include "app/options.hpp"
#include "app/report_pages.hpp"
#include "commission/margin_survey.hpp"
#include "formats/logs/recorded_log.hpp"
#include "formats/robots/online_model_file.hpp"
#include "results/margins_json.hpp"
#include "results/report/detect_report.hpp"
#include "results/software.hpp"
#include "results/words/detect_words.hpp"
#include "results/words/text.hpp"

namespace wheelwright::app {
using namespace words;
namespace margins_command {
namespace {

struct Arguments {
  std::filesystem::path log, model;
  std::vector<std::string> faults;
  std::vector<double> windows;
  std::optional<detector::Persistence> persistence;
  commission::MarginSurveyOptions survey;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Says beforehand which faults a commissioned robot's detector is certain to see, from what size on, how soon, and "
    "in "
    "which manoeuvre: for the motion of LOG, whatever the parameters within their bounds and the noise within its own. "
    "Whether that is guaranteed, extrapolated or statistical depends on what the model stands on, and is said.";

constexpr const char* kExamples =
    "LOG is a drive to be judged: the one that was commissioned with, another, or a simulated one. A row of the table "
    "is\n"
    "a fault on one side (growing or shrinking), a column what the robot does when it sets in; an entry is the size "
    "from\n"
    "which on it is certainly seen within the window, whenever it sets in during such driving, or at so many of "
    "the moments that were tried.\n\n"
    "Examples:\n"
    "  wheelwright margins drive.csv --model result/model.json --out margins\n"
    "  wheelwright margins drive.csv --model result/model.json --fault wheel_radius --fault payload_lost --window 0.5";

std::string table(const commission::MarginSurvey& survey, const commission::ResidualMargins& residual) {
  const std::size_t window = shown_window(survey);
  constexpr std::size_t name_width = 28, width = 19;
  std::string out = fmt::format("{} residual, seen for certain within {:g} s, when it sets in while\n", residual.name,
                                survey.windows[window]);
  out += padded("", name_width);
  for (const auto& [kind, count] : survey.manoeuvres) {
    const std::string_view name = detector::manoeuvre_words(kind);
    out += padded(std::string(name.substr(0, name.find(' '))), width);
  }
  out += "\n";
  for (const detector::FaultMargins& margins : residual.margins) {
    const bool sides = !margins.fault.whole && margins.fault.range.lower < 0.0;
    out += padded("  " + margins.fault.name + (sides ? margins.side > 0.0 ? " +" : " −" : ""), name_width);
    for (const auto& [kind, count] : survey.manoeuvres) {
      out += padded(certain_words(margins, window, kind), width);
    }
    out += "\n";
  }
  return out;
}

// Both guarantees side by side.
std::string risk_table(const commission::MarginSurvey& survey) {
  constexpr std::size_t name_width = 28, width = 13;
  std::string out = "seen for certain from half of all moments\n" + padded("  within", name_width);
  for (const double within : kRiskWindows) {
    out += padded(fmt::format("{:g} s", within), 2 * width);
  }
  out += "\n" + padded("", name_width);
  for (std::size_t w = 0; w < kRiskWindows.size(); ++w) {
    out += padded("every noise", width) + padded("at risk", width);
  }
  out += "\n";
  for (const RiskSizes& sizes : risk_sizes(survey)) {
    out += padded("  " + sizes.fault, name_width);
    for (std::size_t w = 0; w < kRiskWindows.size(); ++w) {
      out += padded(sizes.worst_case[w], width) + padded(sizes.at_risk[w], width);
    }
    out += "\n";
  }
  return out;
}

int run(const Arguments& a) {
  const OnlineModel model = read_model(a.model);
  make_directory(a.common, {"margins.json"});
  const auto opened = open_robot_log({a.log}, model.robot, a.common);
  logs::RecordedLog& log = *opened;
  const report::ReportContext context = report_context(a.common, log.report(), log);
  Progress progress(a.common.quiet);
  commission::MarginSurveyOptions options = a.survey;
  options.faults = a.faults;
  options.persistence = a.persistence;
  if (!a.windows.empty()) {
    options.margins.windows = a.windows;
    std::sort(options.margins.windows.begin(), options.margins.windows.end());
  }
  options.margins.threads = static_cast<std::size_t>(a.common.threads);
  options.margins.progress = [&](std::string_view stage, double share) { progress.tell(stage, share); };
  const commission::MarginSurvey survey = or_failure_page(a.common, context, [&] {
    logs::require_columns(log, model.measurement.columns());
    return commission::survey_margins(log, model, options);
  });
  if (!a.common.out.empty() || a.common.json) {
    publish(a.common, results::to_json(survey, a.model.string(), a.log.string(), results::software()), "margins.json",
            a.common.out.empty() ? std::string() : report::margins_report(survey, model, context));
  }
  if (!a.common.quiet && !a.common.json) {
    print_log(logs::sentences(log.report()));
    for (const commission::ResidualMargins& residual : survey.residuals) {
      say_lines(table(survey, residual) + certain_meaning(residual.warrant) + "\n");
    }
    if (survey.at_risk) {
      say_lines(risk_table(survey) + risk_meaning(*survey.at_risk) + "\n");
    }
    if (!survey.without_kinematic.empty()) {
      say("no kinematic residual: {}\n", survey.without_kinematic);
    }
    if (!a.common.out.empty()) {
      say("wrote {} and {}\n", (a.common.out / "margins.json").string(), (a.common.out / "report.html").string());
    }
  }
  return kDone;
}

}  // namespace
}  // namespace margins_command

Run add_margins(CLI::App& program) {
  using namespace margins_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("margins", kHelp);
  command.add_option("LOG", a->log, "Log (CSV also .gz and .zst, rosbag2, HDF5)")->required();
  command.add_option("--model", a->model, "model.json of `wheelwright commission`")->required()->type_name("FILE");
  command.add_option("--fault", a->faults, "Only this fault of the catalogue (may be repeated)")
      ->type_name("NAME")
      ->allow_extra_args(false);
  command
      .add_option("--window", a->windows, "Time after the onset by which a fault is to be seen, s (may be repeated)")
      ->transform(in_unit("s"))
      ->type_name("S")
      ->allow_extra_args(false)
      ->check(CLI::Range(1e-3, 3600.0));
  command.add_option("--onset-step", a->survey.margins.onset_step, "Time between the onsets that are tried, s")
      ->transform(in_unit("s"))
      ->type_name("S")
      ->check(CLI::Range(1e-3, 3600.0))
      ->capture_default_str();
  command
      .add_option("--noise-share", a->survey.margins.noise_share,
                  "Share of the noise bounds that noise uses, for the size below which a fault stays hidden")
      ->type_name("Q")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  add_set(command, a->survey.set);
  add_persistence(command, a->persistence, "the model's");
  add_map(command, a->common);
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app

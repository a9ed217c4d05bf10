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
#include "app/run_items.hpp"
#include "formats/files/bytes.hpp"
#include "formats/robots/robot_file.hpp"
#include "results/report/sensitivity_report.hpp"
#include "results/software.hpp"
#include "results/study_json.hpp"
#include "results/words/study_summary.hpp"
#include "study/study_work.hpp"

namespace wheelwright::app {
using namespace words;
namespace sensitivity_command {
namespace {

struct Arguments {
  std::filesystem::path study;
  ScaleOptions scale;
  CommonOptions common;
};

constexpr const char* kHelp =
    "What would a better sensor, another filter or a longer drive buy? Commissions the robot of a study file at many "
    "settings of its inputs and says how bounds, thresholds and the smallest faults that are certainly seen depend on "
    "them.";

constexpr const char* kExamples =
    "A study file:\n"
    "  scenario: scenario.yaml          # driven anew at every point; or log: drive.csv and robot: robot.yaml\n"
    "  inputs:\n"
    "    noise.effort: [0.005, 0.05]\n"
    "    filter.beta: {range: [5, 60], scale: log}\n"
    "    wheel_radius: {relative: [-0.02, 0.02]}\n"
    "  quantities: [width, threshold.mean, smallest_fault.wheel_radius]\n"
    "  methods: {local: true, one_at_a_time: {levels: 5}, sobol: {points: 64}}\n\n"
    "Examples:\n"
    "  wheelwright sensitivity study.yaml --out result --threads 8\n"
    "  mpirun wheelwright sensitivity study.yaml --out result\n"
    "  wheelwright sensitivity study.yaml --out result --shard 3/40     # of a job array; then --merge\n\n"
    "Results are kept as they come: a run that was killed goes on where it was. docs/methods/sensitivity.md lists all "
    "inputs "
    "and "
    "quantities.";

// What the drive and the robot are, apart from the inputs.
std::string fingerprint_of(const study::Study& study) {
  files::Xxh64 hash;
  const auto add = [&](const std::string& text) { hash.update(text.data(), text.size()); };
  add(robots::robot_yaml(study.subject.robot));
  if (study.subject.scenario) {
    add(robots::robot_yaml(study.subject.scenario->robot));
  }
  const LogTable drive = study::drive_of_case(study.subject);
  const auto numbers = [&](const std::vector<double>& column) {
    hash.update(reinterpret_cast<const char*>(column.data()), column.size() * sizeof(double));
  };
  numbers(drive.t);
  for (std::size_t c = 0; c < drive.names.size(); ++c) {
    add(drive.names[c]);
    numbers(drive.columns[c]);
  }
  return hash.text();
}

ItemsToRun items_of(const study::Study& study, const study::StudyDesign& design) {
  ItemsToRun items;
  items.work = study::work_of(study, design);
  items.key = [&](std::size_t item) { return study::name_of_point(study, study::point_of(design, item)); };
  std::string quantities;
  for (const study::StudyQuantity& quantity : study.quantities) {
    quantities += (quantities.empty() ? "" : ", ") + quantity.name;
  }
  items.plan = {{"robot and drive", fingerprint_of(study)},
                {"quantities", quantities},
                {"window", fmt::format("{}", study.evaluate.window)}};
  return items;
}

int run(const Arguments& a) {
  make_directory(a.common, {"sensitivity.json"}, lock_for(a.scale));
  results::StudyFile file = results::read_study(a.study);
  const study::Study& study = file.study;
  const study::StudyDesign design = study::design_of(study);
  Progress progress(a.common.quiet);
  const ItemsRun done = run_items(items_of(study, design), a.common, a.scale, [&](std::size_t k, std::size_t n) {
    progress.tell(fmt::format("point {} of {}", k, n), n > 0 ? static_cast<double>(k) / static_cast<double>(n) : 1.0);
  });
  if (!done.results) {
    return kDone;
  }
  study::StudyValues values(study, design);
  done.results->each([&](std::size_t item, std::string_view text) { values.put(item, study::case_result(text)); });
  const study::StudyResult result = values.result();
  const std::optional<study::LocalSensitivity> local = study::nominal_derivatives(study, file.notes);
  report::ReportContext context;
  context.software = results::software();
  context.command_line = a.common.command_line;
  publish(a.common, results::to_json(file, result, local, a.study.string(), results::software()), "sensitivity.json",
          a.common.out.empty() ? std::string() : report::sensitivity_report(study, result, local, file.notes, context));
  if (!a.common.quiet && !a.common.json) {
    print_log(file.notes);
    say_lines(summary(study, result, local));
    if (!a.common.out.empty()) {
      say("wrote {} and {}\n", (a.common.out / "sensitivity.json").string(), (a.common.out / "report.html").string());
    }
  }
  return kDone;
}

}  // namespace
}  // namespace sensitivity_command

Run add_sensitivity(CLI::App& program) {
  using namespace sensitivity_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("sensitivity", kHelp);
  command.add_option("STUDY", a->study, "Study file (YAML)")->required();
  add_scale_options(command, a->scale);
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app

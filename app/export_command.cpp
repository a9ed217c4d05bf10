// SPDX-License-Identifier: Apache-2.0
#include <memory>

#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "app/commands.hpp"
#include "app/common.hpp"
#include "app/options.hpp"
#include "commission/watch/risk_watch.hpp"
#include "detector/export/export_c.hpp"
#include "detector/online_model.hpp"
#include "formats/files/bytes.hpp"
#include "formats/robots/online_model_file.hpp"
#include "results/assumptions_json.hpp"
#include "results/detection_json.hpp"
#include "results/software.hpp"

namespace wheelwright::app {
namespace export_command {
namespace {

struct Arguments {
  std::filesystem::path model;
  std::string language;
  std::string name = exporter::CExportOptions{}.name;
  detector::DetectorOptions detector;
  std::optional<detector::Persistence> persistence;
  CommonOptions common;
};

constexpr const char* kHelp =
    "Writes the detector of a commissioned model as one self-contained source file, with the model's numbers inside, "
    "for "
    "a controller that has neither this program nor its library.";

constexpr const char* kExamples =
    "Examples:\n"
    "  wheelwright export result/model.json --language c --out firmware\n"
    "  wheelwright export result/model.json --language c --set box --name left_robot > left_robot.h\n\n"
    "The file says how it is used. It decides as `wheelwright detect` does.";

Json to_json(const Arguments& a, const OnlineModel& model, const TorqueDetector& detector, const std::string& file,
             const std::string& text) {
  Json result;
  result["schema"] = "wheelwright/export/1";
  result["software"] = results::software();
  result["command"] = a.common.command_line;
  result["model"] = a.model.string();
  result["language"] = a.language;
  result["name"] = a.name;
  result["set"] = a.detector.set == detector::ParameterSetKind::box ? "box" : "polytope";
  result["test"] = a.detector.test == detector::Test::two_sided ? "two_sided" : "symmetric";
  const detector::Persistence persistence = detector.options().persistence.value_or(detector::Persistence{});
  result["persistence"] = {{"k", persistence.k}, {"n", persistence.n}};
  result["sample"] = model.measurement.columns();
  result["outputs"] = model.model.outputs;
  std::size_t vertices = 0;
  if (const auto& table = detector.threshold().table()) {
    for (const bounds::VertexGraph& graph : table->graphs()) {
      vertices += graph.vertices();
    }
  }
  result["vertices"] = vertices;
  if (a.detector.residual == detector::Residual::d2) {
    result["residual"] = "d2";
  }
  result["warrant"] = results::threshold_word(model.warrant, a.detector.residual);
  result["assumptions"] = results::assumptions_json(model.assumptions);
  if (file.empty()) {
    result["text"] = text;
  } else {
    result["file"] = file;
    result["bytes"] = text.size();
  }
  return result;
}

int run(const Arguments& a) {
  OnlineModel model = decided_by(read_model(a.model), a.detector.residual);
  model.persistence = a.persistence.value_or(model.persistence);
  const Detector detector = make_detector(model, a.detector);
  const exporter::CExportOptions options{
      .name = a.name,
      .robot = model.robot.name,
      .source = fmt::format("{}, thresholds {}", a.model.filename().string(),
                            a.detector.residual == detector::Residual::d2 ? "constant, by experiment, without guarantee"
                                                                          : core::warrant_word(model.warrant)),
      .software = results::software()};
  const double false_alarms = model.at_risk ? commission::torque_false_alarms(model) : 0.0;
  const std::string text = exporter::c_header(model, a.detector, false_alarms, options);
  std::string file;
  if (!a.common.out.empty()) {
    file = (a.common.out / (a.name + ".h")).string();
    keep_inputs(file, a.common.read);
    make_directory(a.common);
    keep_existing(a.common, file, fmt::format("/* {}.h: on-line fault detector.", a.name));
    files::atomic_write(file, text);
  }
  if (a.common.json) {
    say_json(to_json(a, model, detector, file, text));
  } else if (file.empty()) {
    say_lines(text);
  } else if (!a.common.quiet) {
    say("wrote {} ({:.0f} kB)\n", file, static_cast<double>(text.size()) / 1000.0);
  }
  return kDone;
}

}  // namespace
}  // namespace export_command

Run add_export(CLI::App& program) {
  using namespace export_command;
  auto a = std::make_shared<Arguments>();
  CLI::App& command = *program.add_subcommand("export", kHelp);
  command.add_option("MODEL", a->model, "model.json of `wheelwright commission`")->required();
  command.add_option("--language", a->language, "Language of the file: c (C99, a header)")
      ->required()
      ->check(CLI::IsMember({"c"}));
  command.add_option("--name", a->name, "Prefix of all names in the file, and the file's name")
      ->type_name("PREFIX")
      ->capture_default_str();
  add_residual(command, a->detector.residual);
  add_set(command, a->detector.set);
  add_test(command, a->detector.test);
  add_persistence(command, a->persistence, "the model's");
  return finish(command, a, kExamples, run);
}

}  // namespace wheelwright::app

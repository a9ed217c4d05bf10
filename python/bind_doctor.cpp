// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <map>
#include <optional>
#include <variant>

#include <pybind11/stl/filesystem.h>
#include <nlohmann/json.hpp>

#include "commission/choice/detector_choice.hpp"
#include "commission/model_comparison.hpp"
#include "commission/watch/risk_watch.hpp"
#include "core/check.hpp"
#include "detector/export/export_c.hpp"
#include "formats/files/bytes.hpp"
#include "formats/robots/controller_file.hpp"
#include "formats/robots/online_model_file.hpp"
#include "formats/robots/robot_file.hpp"
#include "formats/robots/robot_origin.hpp"
#include "python/module.hpp"
#include "results/check_words.hpp"
#include "results/choice_json.hpp"
#include "results/comparison_json.hpp"
#include "results/health_json.hpp"
#include "results/model_check.hpp"
#include "results/software.hpp"
#include "results/words/choice_summary.hpp"
#include "results/words/comparison_words.hpp"
#include "results/words/health_summary.hpp"

namespace wheelwright::python {
namespace {

using Path = std::filesystem::path;
using RobotOrModel = std::variant<const RobotObject*, const ModelObject*>;
using Faults = std::variant<std::map<std::string, std::optional<double>>, std::vector<std::string>>;

struct HealthObject {
  doctor::LogHealth health;
  Json json;
  std::string summary;
};

std::unique_ptr<HealthObject> doctor_of(LogObject& log, const std::optional<RobotOrModel>& of, std::size_t rows) {
  check::that(rows > 0, "rows", "a number >= 1");
  const RobotObject* const given = of && of->index() == 0 ? std::get<0>(*of) : nullptr;
  const ModelObject* const model = of && of->index() == 1 ? std::get<1>(*of) : nullptr;
  const std::optional<Robot> robot = given != nullptr   ? std::optional(given->robot)
                                     : model != nullptr ? std::optional(model->model->robot)
                                                        : std::nullopt;
  LongWork work{py::none()};
  return work.run([&] {
    const LogWalk walk(log);
    auto out = std::make_unique<HealthObject>();
    out->health = results::examine_first(*log.source, robot, rows);
    const std::string file = given != nullptr ? given->path : model != nullptr ? model->path : "";
    out->json = results::to_json(out->health, {file, log.paths(), results::software()});
    out->summary = words::summary(out->health);
    return out;
  });
}

struct ChoiceObject {
  commission::DetectorChoice choice;
  logs::LogReport data;
  Json json;
  std::string summary;
};

std::vector<commission::StatedFault> stated(const Faults& faults) {
  std::vector<commission::StatedFault> out;
  if (const auto* const names = std::get_if<std::vector<std::string>>(&faults)) {
    for (const std::string& name : *names) {
      out.push_back({name});
    }
    return out;
  }
  for (const auto& [name, size] : std::get<0>(faults)) {
    if (size) {
      check::positive(*size, "faults['" + name + "']");
    }
    out.push_back({name, size});
  }
  return out;
}

std::unique_ptr<ChoiceObject> choose(LogObject& log, const RobotObject& robot, const Faults& faults, double window,
                                     double false_alarms, const std::string& guarantee, std::size_t threads,
                                     py::object progress) {
  check::that(guarantee == "every_noise" || guarantee == "either", "guarantee '" + guarantee + "'",
              "every_noise or either");
  LongWork work(std::move(progress));
  commission::DetectorChoiceOptions options;
  options.trial.faults = stated(faults);
  options.trial.window = window;
  options.trial.false_alarms = false_alarms;
  options.trial.threads = threads;
  options.either = guarantee == "either";
  options.progress = work.teller();
  return work.run([&] {
    const LogWalk walk(log);
    logs::require_columns(*log.source, robots::needed_columns(robot.robot));
    WatchedLog source(*log.source, work);
    auto out = std::make_unique<ChoiceObject>();
    out->choice = commission::choose_detector(
        source, model::with_column_errors(robot.robot, logs::interpolation_errors(log.source->report())), options);
    out->data = log.source->report();
    out->json = results::to_json(out->choice, robot.path, log.paths(), results::software());
    const bool chosen = out->choice.chosen.has_value();
    out->summary = words::summary(
        out->choice, chosen ? results::robot_file_line(out->choice.candidates.front().filter) : std::string());
    return out;
  });
}

struct CheckObject {
  bool proved = false;
  Json json;
  std::string summary;
};

std::unique_ptr<CheckObject> check_against(const py::object& of, LogObject& log) {
  results::ModelClaims claims;
  std::string file;
  if (const std::optional<Json> json = commission_json(of)) {
    claims =
        results::claims_from_json(files::parse_json(files::json_text(*json), "the commissioning"), "the commissioning");
  } else {
    const bool is_model = py::isinstance<ModelObject>(of);
    const Path path = is_model ? Path(of.cast<const ModelObject&>().path) : of.cast<Path>();
    check::that(!path.empty(), "model", "one that was read from a file, or the Commission that it came from");
    file = path.string();
    claims = results::read_claims(path);
  }
  LongWork work{py::none()};
  return work.run([&] {
    const LogWalk walk(log);
    logs::require_columns(*log.source, claims.measurement.columns());
    if (claims.kinematic) {
      logs::require_columns(*log.source, claims.kinematic->model.measurement.columns());
    }
    WatchedLog source(*log.source, work);
    const results::ModelCheck check = results::check_model(claims, source, log.source->report());
    return std::make_unique<CheckObject>(CheckObject{
        check.proved(), results::to_json(check, claims, log.source->report(), {file, log.paths()}, results::software()),
        results::check_summary(check, claims)});
  });
}

std::string exported(const ModelObject& given, const std::string& language, const std::string& name,
                     const std::string& set, const std::string& test, const Rule& persistence) {
  check::that(language == "c", "language '" + language + "'", "c (C99, a header)");
  OnlineModel model = *given.model;
  if (persistence) {
    model.persistence = {persistence->first, persistence->second};
  }
  const Path file = given.path.empty() ? Path("model.json") : Path(given.path).filename();
  const exporter::CExportOptions options{
      .name = name,
      .robot = model.robot.name,
      .source = file.string() + ", thresholds " + std::string(core::warrant_word(model.warrant)),
      .software = results::software()};
  const detector::DetectorOptions detector = options_of(set, test, std::nullopt);
  const double false_alarms = model.at_risk ? commission::torque_false_alarms(model) : 0.0;
  const py::gil_scoped_release unlocked;
  return exporter::c_header(model, detector, false_alarms, options);
}

struct RobotFileObject {
  robots::RobotWithOrigins robot;
  std::string text;
};

RobotFileObject robot_from(const std::optional<Path>& urdf, const std::optional<Path>& ros2_control,
                           const std::string& controller, const std::vector<std::string>& left,
                           const std::vector<std::string>& right, const std::optional<double>& wheel_radius,
                           const std::optional<double>& track_width, const std::vector<std::string>& massless,
                           const std::optional<std::string>& name) {
  check::that(urdf || ros2_control, "robot_from", "at least one of urdf, ros2_control");
  check::that(controller.empty() || ros2_control, "controller '" + controller + "'", "ros2_control with it");
  std::optional<robots::RobotTree> tree;
  std::optional<robots::DriveFacts> facts;
  if (urdf) {
    tree = robots::read_urdf(*urdf);
  }
  if (ros2_control) {
    facts = robots::read_ros2_control(*ros2_control, controller);
  }
  RobotFileObject out;
  out.robot = robots::robot_from(tree ? &*tree : nullptr, facts ? &*facts : nullptr,
                                 {left, right, wheel_radius, track_width, massless, name});
  out.text = robots::robot_yaml(out.robot);
  static_cast<void>(robots::parse_robot(out.text, "the robot file"));
  return out;
}

struct ComparisonObject {
  bool changed = false;
  Json json;
  std::string summary;
};

// A model with what is known of where it comes from.
std::pair<OnlineModel, results::ComparedModel> comparable(const py::object& of) {
  if (py::isinstance<ModelObject>(of) && of.cast<const ModelObject&>().path.empty()) {
    const OnlineModel& model = *of.cast<const ModelObject&>().model;
    return {model, {.file = "", .robot = model.robot.name, .software = results::software()}};
  }
  const Path path = py::isinstance<ModelObject>(of) ? Path(of.cast<const ModelObject&>().path) : of.cast<Path>();
  return {robots::read_model(path), results::compared_model(path.string())};
}

std::unique_ptr<ComparisonObject> compare(const py::object& before, const py::object& after) {
  const auto [first, first_named] = comparable(before);
  const auto [second, second_named] = comparable(after);
  LongWork work{py::none()};
  return work.run([&, &one = first, &two = second, &one_named = first_named, &two_named = second_named] {
    const commission::ModelComparison comparison =
        commission::compare_models(one, two, one_named.guesses, two_named.guesses);
    return std::make_unique<ComparisonObject>(
        ComparisonObject{comparison.changed(), results::to_json(comparison, one_named, two_named, results::software()),
                         words::summary(comparison)});
  });
}

void bind_compare(py::module_& m) {
  py::class_<ComparisonObject> compared(m, "ModelComparison", "Two models against each other: comparison.json.");
  compared.def_readonly("changed", &ComparisonObject::changed, "whether something has changed between their logs");
  result_of(compared, "comparison");
  members_of(compared, {"message", "explanations", "sets", "guesses"});
  m.def("compare", &compare, py::arg("before"), py::arg("after"),
        "What has changed for certain between the logs of two models, and which parameters alone explain it, as "
        "`wheelwright compare` says.\n\n"
        "before, after: a model.json or a Model. Raises InvalidArgument where their parameters do not mean the same. "
        "The interpreter's lock is released.");
}

void bind_check(py::module_& m) {
  py::class_<CheckObject> checked(m, "ModelCheck", "What became of the proofs of a model.json: check.json.");
  checked.def_readonly("proved", &CheckObject::proved, "whether everything is");
  result_of(checked, "check");
  members_of(checked, {"message", "scope", "bounds", "facets", "failures", "warnings", "premises", "assumptions"});
  m.def("check", &check_against, py::arg("model"), py::arg("log"),
        "Proves the bounds of a model again from the log that it was made from, in exact arithmetic, as `wheelwright "
        "check` does.\n\n"
        "model: a model.json, a Model that was read from one, or a Commission. log: read with the model's robot from "
        "the files that it was commissioned on, in their order. The interpreter's lock is released; Ctrl-C ends the "
        "work.");
  m.def(
      "export", &exported, py::arg("model"), py::arg("language") = "c", py::kw_only(),
      py::arg("name") = exporter::CExportOptions{}.name, py::arg("set") = "polytope", py::arg("test") = "two_sided",
      py::arg("persistence") = std::nullopt,
      "The detector of a model as the text of one source file (c: a C99 header), as `wheelwright export` writes it.\n\n"
      "name: prefix of all names in it. set, test, persistence: as in Detector.");
}

void bind_robot_file(py::module_& m) {
  py::class_<RobotFileObject> file(m, "RobotFile", "A robot from the files of others; each value says its origin.");
  file.def_property_readonly("robot",
                             [](const RobotFileObject& f) {
                               return RobotObject{f.robot.robot, ""};
                             })
      .def_property_readonly(
          "origins", [](const RobotFileObject& f) { return f.robot.origins; }, "by key of the robot file")
      .def_property_readonly(
          "remarks", [](const RobotFileObject& f) { return f.robot.remarks; }, "what needs the reader's eye")
      .def_property_readonly(
          "files", [](const RobotFileObject& f) { return f.robot.files; }, "that were read")
      .def_readonly("summary", &RobotFileObject::text, "the text of the robot file, an origin above each value")
      .def(
          "to_dict", [](const RobotFileObject& f) { return to_python(robots::to_json(f.robot, results::software())); },
          "What `wheelwright robot --json` prints (results/robot-file.schema.json).")
      .def(
          "save", [](const RobotFileObject& f, const Path& path) { files::atomic_write(path, f.text); },
          py::arg("path"), "Writes the robot file, whole or not at all.");
  tables_of(file);
  m.def("robot_from", &robot_from, py::arg("urdf") = std::nullopt, py::arg("ros2_control") = std::nullopt,
        py::kw_only(), py::arg("controller") = "", py::arg("left") = std::vector<std::string>{},
        py::arg("right") = std::vector<std::string>{}, py::arg("wheel_radius") = std::nullopt,
        py::arg("track_width") = std::nullopt, py::arg("massless") = std::vector<std::string>{},
        py::arg("name") = std::nullopt,
        "A robot from its URDF and the parameters of its diff_drive_controller, as `wheelwright robot` makes it.\n\n"
        "controller: its name, where the file has several. left, right: joints of the driven wheels. wheel_radius, "
        "track_width: m, before what the files say. massless: links that have a shape and no mass. Raises InputError, "
        "naming file, line and element.");
}

}  // namespace

void bind_doctor(py::module_& m) {
  py::class_<HealthObject> health(m, "LogHealth", "What a log lacks: doctor.json.");
  health
      .def_property_readonly(
          "fit", [](const HealthObject& h) { return h.health.verdict == doctor::LogVerdict::commission; },
          "whether the log can be commissioned")
      .def("__len__", [](const HealthObject& h) { return h.health.findings.size(); });
  result_of(health, "doctor");
  members_of(health, {"verdict", "sentence", "findings", "assumed", "rows", "segments", "seconds", "median_step"});
  m.def(
      "doctor", &doctor_of, py::arg("log"), py::arg("robot") = std::nullopt, py::kw_only(), py::arg("rows") = 1000000,
      "Says what a log lacks before anything is made of it, as `wheelwright doctor` does.\n\n"
      "robot: a Robot, or a Model for its robot; without it the kind of robot is guessed from the columns, and scales "
      "cannot be checked. rows: how many are looked at. The interpreter's lock is released.");
  py::class_<ChoiceObject> choice(m, "DetectorChoice",
                                  "A detector for stated faults, and what every other one costs: choice.json.");
  choice.def_property_readonly(
      "commission",
      [](const ChoiceObject& c) {
        return c.choice.chosen ? commission_object(*c.choice.chosen, c.data) : py::object(py::none());
      },
      "the Commission of the chosen one; None where no candidate is certain to see a stated fault");
  result_of(choice, "choice");
  members_of(choice,
             {"chosen", "robot_file", "candidates", "hopeless", "window", "false_alarms", "recommendation", "notes"});
  m.def("choose", &choose, py::arg("log"), py::arg("robot"), py::kw_only(),
        py::arg("faults") = std::vector<std::string>{}, py::arg("window") = commission::TrialOptions{}.window,
        py::arg("false_alarms") = 0.0, py::arg("guarantee") = "every_noise", py::arg("threads") = 1,
        py::arg("progress") = py::none(),
        "Chooses order, alpha and beta of the filter and the decision rule for the faults that are to be seen, as "
        "`wheelwright choose` does.\n\n"
        "faults: name -> size (None: 0.2 of a share), or names; none: wheel_radius and wheel_radius_right. window: s "
        "after the onset. false_alarms: probability of one in an hour that is allowed; 0: never within the declared "
        "noise. guarantee: every_noise, or either, by whichever sees a fault first (docs/methods/risk.md). The result "
        "does not "
        "depend on `threads`. The interpreter's lock is released; Ctrl-C ends the work.");
  bind_check(m);
  bind_compare(m);
  bind_robot_file(m);
}

}  // namespace wheelwright::python

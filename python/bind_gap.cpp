// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <optional>

#include <pybind11/stl/filesystem.h>
#include <nlohmann/json.hpp>

#include <wheelwright/core/check.hpp>
#include <wheelwright/files/words.hpp>
#include <wheelwright/gap/diagnose.hpp>
#include <wheelwright/gap/effect.hpp>
#include <wheelwright/logs/log_file.hpp>
#include <wheelwright/results/gap_json.hpp>
#include <wheelwright/robots/robot_file.hpp>
#include <wheelwright/words/gap_words.hpp>

#include <wheelwright/gap/further_drive.hpp>
#include <wheelwright/results/rival_json.hpp>
#include <wheelwright/results/software.hpp>
#include "arrays.hpp"
#include "effect_object.hpp"
#include "long_work.hpp"
#include "module.hpp"

namespace wheelwright::python {

using gap::GapEstimate;

namespace {

struct DiagnosisObject {
  Diagnosis diagnosis;
  gap::NextDrive next;
  Json json;
};

// A residual series that keeps its diagnosis alive.
struct SeriesObject {
  std::shared_ptr<const DiagnosisObject> owner;
  std::size_t index = 0;
  [[nodiscard]] const gap::ResidualSeries& series() const { return owner->diagnosis.series[index]; }
};

void check_names(const std::vector<std::string>& without, const std::vector<Effect>& catalogue) {
  std::vector<std::string> names;
  for (const Effect& effect : catalogue) {
    check::that(std::ranges::find(names, effect.name) == names.end(), "effect " + effect.name, "each name once");
    names.push_back(effect.name);
  }
  for (const std::string& name : without) {
    if (std::ranges::find(names, name) == names.end()) {
      throw InputError("without " + files::shown(name) + ": no effect of the catalogue: expected one of " +
                       core::listed(names) + files::did_you_mean(name, names));
    }
  }
}

std::shared_ptr<DiagnosisObject> gap(LogObject& log, const RobotObject& robot, LogObject* baseline, LogObject* fresh,
                                     const std::vector<Effect>& effects, const std::vector<std::string>& without,
                                     const std::optional<double>& beta, bool shrink, bool manoeuvre, std::uint64_t seed,
                                     std::size_t threads, py::object progress) {
  std::vector<Effect> catalogue = gap::effect_catalogue(model::make_model(robot.robot));
  catalogue.insert(catalogue.end(), effects.begin(), effects.end());
  check_names(without, catalogue);
  gap::DiagnoseOptions options;
  options.catalogue = catalogue;
  options.without = without;
  options.beta = beta;
  options.shrink = shrink;
  options.seed = seed;
  options.threads = threads;
  LongWork work(std::move(progress));
  options.progress = work.teller();
  return work.run([&] {
    const std::vector<std::string> needed = robots::needed_columns(robot.robot);
    const LogWalk walk(log);
    const Robot measured = model::with_column_errors(robot.robot, logs::interpolation_errors(log.source->report()));
    logs::require_columns(*log.source, needed);
    WatchedLog source(*log.source, work);
    std::optional<LogWalk> healthy_walk;
    std::optional<WatchedLog> healthy_source;
    if (baseline != nullptr) {
      healthy_walk.emplace(*baseline);
      logs::require_columns(*baseline->source, needed);
      healthy_source.emplace(*baseline->source, work);
    }
    LogSource* const healthy = healthy_source ? &*healthy_source : nullptr;
    auto out = std::make_shared<DiagnosisObject>();
    Diagnosis& d = out->diagnosis;
    d = diagnose(source, healthy, measured, options);
    if (fresh != nullptr) {
      const LogWalk fresh_walk(*fresh);
      logs::require_columns(*fresh->source, needed);
      WatchedLog fresh_source(*fresh->source, work);
      d.shrink.fresh_torque_rms = gap::torque_on(fresh_source, healthy, measured, d, options);
    }
    if (manoeuvre) {
      out->next = gap::what_next(source, healthy, measured, d, options);
    }
    for (std::vector<std::string>* texts : {&d.notes, &d.not_excited}) {
      for (std::string& text : *texts) {
        text = words::in_words(text, catalogue);
      }
    }
    out->next.sentence = words::in_words(out->next.sentence, catalogue);
    const std::string promise = out->next.commands ? out->next.sentence : "";
    if (d.summary.empty()) {
      d.summary = words::gap_verdict(d);
      for (const std::string& sentence : words::gap_sentences(d, promise)) {
        d.summary += " " + sentence;
      }
    }
    results::GapFiles files;
    files.robot = robot.path;
    files.logs = log.paths();
    files.baseline = baseline != nullptr ? baseline->name() : "";
    files.software = results::software();
    if (out->next.commands) {
      files.next_manoeuvre = results::NextManoeuvre{"", promise};
    }
    out->json = results::to_json(d, files);
    out->json["improved"] = nullptr;
    results::add_rivals(out->json, out->next.rivals, catalogue);
    return out;
  });
}

void bind_cause(py::module_& m) {
  py::class_<GapEstimate>(m, "GapEstimate", "A number with its 95 % interval.")
      .def_readonly("name", &GapEstimate::name)
      .def_readonly("unit", &GapEstimate::unit)
      .def_readonly("estimate", &GapEstimate::estimate)
      .def_readonly("lower", &GapEstimate::lower)
      .def_readonly("upper", &GapEstimate::upper)
      .def("__repr__", [](const GapEstimate& e) {
        return "<wheelwright.GapEstimate " + e.name + ": " + words::estimate_words(e) + ">";
      });
  py::class_<gap::GapCause>(m, "GapCause", "One cause of the best combination.")
      .def_readonly("effect", &gap::GapCause::effect)
      .def_readonly("sentence", &gap::GapCause::sentence)
      .def_readonly("parametric", &gap::GapCause::parametric)
      .def_readonly("share", &gap::GapCause::share, "of the gap (Shapley value over the combination)")
      .def_property_readonly(
          "parameters",
          [](const gap::GapCause& c) {
            py::dict out;
            for (const GapEstimate& e : c.parameters) {
              out[py::str(e.name)] = e;
            }
            return out;
          },
          "by name")
      .def("__repr__", [](const gap::GapCause& c) { return "<wheelwright.GapCause " + c.effect + ">"; });
  py::class_<SeriesObject> series(m, "ResidualSeries",
                                  "Residuals of one channel on the rows that the analysis used; read-only views of "
                                  "shape (rows,), empty where there is none.");
  series
      .def_property_readonly(
          "space",
          [](const SeriesObject& s) { return s.series().space == gap::GapSpace::dynamic ? "dynamic" : "kinematic"; })
      .def_property_readonly("channel", [](const SeriesObject& s) { return s.series().channel; })
      .def_property_readonly("unit", [](const SeriesObject& s) { return s.series().unit; })
      .def_property_readonly(
          "floor", [](const SeriesObject& s) { return s.series().floor; }, "standard deviation of the noise");
  const auto array = [&series](const char* name, Eigen::VectorXd gap::ResidualSeries::*member, const char* doc) {
    series.def_property_readonly(
        name,
        [member](const py::object& self) { return view(self.cast<const SeriesObject&>().series().*member, self); },
        doc);
  };
  array("t", &gap::ResidualSeries::t, "s");
  array("signal", &gap::ResidualSeries::signal, "the left side: filtered effort, or increment of the pose");
  array("nominal", &gap::ResidualSeries::nominal, "left by the nominal model");
  array("refitted", &gap::ResidualSeries::refitted, "left by the model with theta fitted again");
  array("after", &gap::ResidualSeries::after, "left with the causes");
}

}  // namespace

void bind_gap(py::module_& m) {
  bind_effect(m);
  bind_cause(m);
  py::class_<DiagnosisObject, std::shared_ptr<DiagnosisObject>> diagnosis(
      m, "Diagnosis", "The sim-to-real gap of a robot: gap.json and the numbers behind it.");
  diagnosis
      .def_property_readonly(
          "verdict", [](const DiagnosisObject& d) { return std::string(results::name_of(d.diagnosis.verdict)); },
          "no_gap, explained, ambiguous or unexplained")
      .def_property_readonly("summary", [](const DiagnosisObject& d) { return d.diagnosis.summary; })
      .def_property_readonly(
          "causes", [](const DiagnosisObject& d) { return d.diagnosis.causes; }, "largest share first")
      .def_property_readonly(
          "gap", [](const DiagnosisObject& d) { return d.diagnosis.gap; },
          "what the nominal model leaves above the noise floor, share of the efforts' mean square")
      .def_property_readonly(
          "structural", [](const DiagnosisObject& d) { return d.diagnosis.structural; },
          "the part of it that stays after theta is fitted again")
      .def_property_readonly(
          "remaining", [](const DiagnosisObject& d) { return d.diagnosis.remaining; },
          "share of the gap that the causes leave")
      .def_property_readonly("notes", [](const DiagnosisObject& d) { return d.diagnosis.notes; })
      .def_property_readonly(
          "theta", [](const DiagnosisObject& d) { return copy(d.diagnosis.theta); },
          "with the causes beside it, shape (p,)")
      .def_property_readonly(
          "series",
          [](const std::shared_ptr<DiagnosisObject>& d) {
            std::vector<SeriesObject> out;
            for (std::size_t i = 0; i < d->diagnosis.series.size(); ++i) {
              out.push_back({d, i});
            }
            return out;
          },
          "residuals of each channel, for pictures")
      .def_property_readonly(
          "improved",
          [](const DiagnosisObject& d) {
            return d.diagnosis.improved ? std::optional<RobotObject>(RobotObject{*d.diagnosis.improved, ""})
                                        : std::nullopt;
          },
          "the robot with its causes, where a robot file can carry them; else None")
      .def_property_readonly(
          "next_commands",
          [](const DiagnosisObject& d) {
            return d.next.commands ? std::optional<py::dict>(arrays_of(*d.next.commands)) : std::nullopt;
          },
          "wheel-speed commands of the drive that would tell the causes apart, by name; None where there is none")
      .def(
          "to_dict", [](const DiagnosisObject& d) { return to_python(d.json); },
          "The content of gap.json (results/gap.schema.json).")
      .def(
          "save", [](const DiagnosisObject& d, const std::filesystem::path& path) { files::write_json(path, d.json); },
          py::arg("path"), "Writes gap.json, whole or not at all.")
      .def("__repr__", [](const DiagnosisObject& d) {
        return std::string("<wheelwright.Diagnosis: ") + results::name_of(d.diagnosis.verdict) + ">";
      });
  for (const char* key : {"credible_set", "confusable", "where", "shrink", "parametric", "contradictions",
                          "next_manoeuvre", "not_excited", "floor_error", "floor_origin"}) {
    diagnosis.def_property_readonly(
        key, [key](const DiagnosisObject& d) { return to_python(d.json[key]); }, "as in gap.json");
  }
  m.def("gap", &gap, py::arg("log"), py::arg("robot"), py::kw_only(), py::arg("baseline") = nullptr,
        py::arg("fresh") = nullptr, py::arg("effects") = std::vector<Effect>{},
        py::arg("without") = std::vector<std::string>{}, py::arg("beta") = std::nullopt, py::arg("shrink") = true,
        py::arg("manoeuvre") = true, py::arg("seed") = 1, py::arg("threads") = 1, py::arg("progress") = py::none(),
        "Diagnoses the gap between the model of a robot and a log of it, as `wheelwright gap` does.\n\n"
        "baseline: a log of the same robot when it was healthy. fresh: another log of it as it is now. effects: a "
        "user's own, looked for beside the catalogue's. without: names that are not looked for. beta: of the filter, "
        "1/s. shrink: measure how far the gap shrinks (most of the time). manoeuvre: design a drive where causes "
        "cannot be told apart. The result does not depend on `threads`.\n\n"
        "The interpreter's lock is released, and taken for effects written in Python; Ctrl-C ends the work.");
}

}  // namespace wheelwright::python

// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

#include <pybind11/stl/filesystem.h>
#include <nlohmann/json.hpp>

#include <wheelwright/commission/margin_survey.hpp>
#include <wheelwright/core/check.hpp>
#include <wheelwright/results/margins_json.hpp>
#include <wheelwright/words/margin_words.hpp>

#include <wheelwright/results/software.hpp>
#include <wheelwright/robots/robot_columns.hpp>
#include "arrays.hpp"
#include "long_work.hpp"
#include "module.hpp"

namespace wheelwright::python {

using detector::FaultMargins;

namespace {

struct MarginsObject {
  commission::MarginSurvey survey;
  std::string model, log;
  [[nodiscard]] Json json() const { return results::to_json(survey, model, log, results::software()); }
};

using Rule = std::optional<std::pair<std::size_t, std::size_t>>;

std::unique_ptr<MarginsObject> survey(LogObject& log, const ModelObject& model, std::vector<std::string> faults,
                                      const std::optional<std::vector<double>>& windows, double onset_step,
                                      double noise_share, const std::string& set, const Rule& persistence,
                                      std::size_t threads, py::object progress) {
  check::that(set == "polytope" || set == "box", "set '" + set + "'", "polytope or box");
  commission::MarginSurveyOptions options;
  options.faults = std::move(faults);
  options.set = set == "box" ? detector::ParameterSetKind::box : detector::ParameterSetKind::polytope;
  options.margins.windows = windows.value_or(options.margins.windows);
  options.margins.onset_step = onset_step;
  options.margins.noise_share = noise_share;
  options.margins.threads = threads;
  if (persistence) {
    options.persistence = detector::Persistence{persistence->first, persistence->second};
  }
  LongWork work(std::move(progress));
  options.margins.progress = work.teller();
  return work.run([&] {
    const LogWalk walk(log);
    logs::require_columns(*log.source, model.model->measurement.columns());
    WatchedLog source(*log.source, work);
    return std::unique_ptr<MarginsObject>(
        new MarginsObject{commission::survey_margins(source, *model.model, options), model.path, log.name()});
  });
}

std::optional<detector::ManoeuvreKind> kind_called(const std::optional<std::string>& name) {
  if (!name) {
    return std::nullopt;
  }
  std::string known;
  for (const detector::ManoeuvreKind kind :
       {detector::ManoeuvreKind::standstill, detector::ManoeuvreKind::cruising, detector::ManoeuvreKind::accelerating,
        detector::ManoeuvreKind::turning, detector::ManoeuvreKind::spinning}) {
    if (detector::manoeuvre_words(kind) == *name) {
      return kind;
    }
    known += (known.empty() ? "" : ", ") + std::string(detector::manoeuvre_words(kind));
  }
  throw InvalidArgument("manoeuvre '" + *name + "': expected one of " + known);
}

void bind_fault(py::module_& m) {
  py::class_<FaultMargins>(m, "FaultMargins",
                           "What a drive is worth for one fault on one side, onset by onset. Sizes are magnitudes in "
                           "`unit` ('1' for a share).")
      .def_property_readonly("fault", [](const FaultMargins& f) { return f.fault.name; })
      .def_property_readonly("sentence", [](const FaultMargins& f) { return f.fault.sentence; })
      .def_property_readonly("unit", [](const FaultMargins& f) { return f.fault.unit; })
      .def_readonly("side", &FaultMargins::side, "1: growing, -1: shrinking")
      .def_property_readonly("largest", &FaultMargins::largest, "the largest size that was looked at")
      .def_property_readonly(
          "t",
          [](const FaultMargins& f) {
            std::vector<double> t;
            for (const detector::OnsetMargin& onset : f.onsets) {
              t.push_back(onset.t);
            }
            return copy(t);
          },
          "onsets, s, shape (onsets,)")
      .def_property_readonly(
          "manoeuvres",
          [](const FaultMargins& f) {
            std::vector<std::string> kinds;
            for (const detector::OnsetMargin& onset : f.onsets) {
              kinds.emplace_back(detector::manoeuvre_words(onset.kind));
            }
            return kinds;
          },
          "what the robot does at each onset, in words")
      .def_property_readonly(
          "certain",
          [](const FaultMargins& f) {
            std::size_t windows = 0;
            for (const detector::OnsetMargin& onset : f.onsets) {
              windows = std::max(windows, onset.certain.size());
            }
            py::array_t<double> out({f.onsets.size(), windows});
            for (std::size_t k = 0; k < f.onsets.size(); ++k) {
              const std::vector<double>& own = f.onsets[k].certain;
              for (std::size_t w = 0; w < windows; ++w) {
                out.mutable_at(k, w) = w < own.size() ? own[w] : std::numeric_limits<double>::quiet_NaN();
              }
            }
            return out;
          },
          "every size from here up is seen for certain within the window: shape (onsets, windows); inf where none is, "
          "NaN where the window runs past the segment's end")
      .def_property_readonly(
          "hidden",
          [](const FaultMargins& f) {
            std::vector<double> hidden;
            for (const detector::OnsetMargin& onset : f.onsets) {
              hidden.push_back(onset.hidden);
            }
            return copy(hidden);
          },
          "no size up to this one raises an alarm within the last window that fits, shape (onsets,)")
      .def(
          "summarise",
          [](const FaultMargins& f, std::size_t window, const std::optional<std::string>& manoeuvre) {
            const detector::MarginSummary s = detector::summarise(f, window, kind_called(manoeuvre));
            py::dict out;
            out["onsets"] = s.onsets;
            out["certain"] = s.certain;
            out["best"] = s.best;
            out["most"] = s.most;
            out["median"] = s.median;
            out["worst"] = s.worst;
            return out;
          },
          py::arg("window"), py::arg("manoeuvre") = std::nullopt,
          "Order statistics of the smallest certain size over the onsets (of one manoeuvre, in words) in window number "
          "`window`: onsets, certain (how many have one), best, most, median, worst.")
      .def("__repr__", [](const FaultMargins& f) {
        return "<wheelwright.FaultMargins of " + f.fault.name + (f.side > 0.0 ? ", growing>" : ", shrinking>");
      });
}

}  // namespace

void bind_margins(py::module_& m) {
  bind_fault(m);
  py::class_<commission::ResidualMargins>(m, "ResidualMargins", "Margins in one residual.")
      .def_readonly("name", &commission::ResidualMargins::name, "torque or kinematic")
      .def_readonly("outputs", &commission::ResidualMargins::outputs, "names of the channels")
      .def_readonly("faults", &commission::ResidualMargins::margins, "each fault and side that this residual can see")
      .def_readonly("blind", &commission::ResidualMargins::blind,
                    "faults that leave no trace in it, whatever their size");
  py::class_<commission::RiskMargins>(m, "RiskMargins", "Margins in sums over scales: certain but for a stated chance.")
      .def_readonly("risk", &commission::RiskMargins::risk, "probability that the set lacks the true parameters")
      .def_readonly("miss", &commission::RiskMargins::miss,
                    "a fault of a certain size is missed with at most this probability")
      .def_readonly("false_alarms", &commission::RiskMargins::false_alarms, "expected number in a second, at most")
      .def_property_readonly(
          "windows", [](const commission::RiskMargins& r) { return copy(r.windows); }, "s, shape (windows,)")
      .def_readonly("faults", &commission::RiskMargins::margins, "each fault and side");
  py::class_<MarginsObject>(m, "Margins", "Detectability along a drive: which faults are certain to be seen.")
      .def_property_readonly(
          "windows", [](const MarginsObject& o) { return copy(o.survey.windows); }, "s, shape (windows,)")
      .def_property_readonly(
          "seconds", [](const MarginsObject& o) { return o.survey.seconds; }, "of driving")
      .def_property_readonly("residuals", [](const MarginsObject& o) { return o.survey.residuals; })
      .def_property_readonly(
          "at_risk", [](const MarginsObject& o) { return o.survey.at_risk; },
          "what is certain at a stated risk; None where the model says nothing at one")
      .def_property_readonly(
          "sentences", [](const MarginsObject& o) { return words::margin_sentences(o.survey); }, "for people")
      .def(
          "to_dict", [](const MarginsObject& o) { return to_python(o.json()); },
          "The content of margins.json (results/margins.schema.json).")
      .def(
          "save", [](const MarginsObject& o, const std::filesystem::path& path) { files::write_json(path, o.json()); },
          py::arg("path"), "Writes margins.json, whole or not at all.");
  const detector::MarginOptions usual;
  m.def("margins", &survey, py::arg("log"), py::arg("model"), py::kw_only(),
        py::arg("faults") = std::vector<std::string>{}, py::arg("windows") = std::nullopt,
        py::arg("onset_step") = usual.onset_step, py::arg("noise_share") = usual.noise_share,
        py::arg("set") = "polytope", py::arg("persistence") = std::nullopt, py::arg("threads") = 1,
        py::arg("progress") = py::none(),
        "Which faults the detector of `model` is certain to see on the motion of `log`, from what size on and how "
        "soon, as `wheelwright margins` does.\n\n"
        "faults: names of the catalogue, by default all. windows: times after the onset, s, ascending. onset_step: "
        "time between the onsets tried, s. noise_share: of the noise bounds, for the size that stays hidden. The "
        "result does not depend on `threads`. The interpreter's lock is released; Ctrl-C ends the work.");
}

}  // namespace wheelwright::python

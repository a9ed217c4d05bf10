// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

#include <pybind11/stl/filesystem.h>
#include <nlohmann/json.hpp>

#include "formats/logs/log_file.hpp"
#include "formats/robots/robot_file.hpp"
#include "python/arrays.hpp"
#include "python/module.hpp"
#include "results/assumptions_json.hpp"
#include "results/model_file.hpp"
#include "results/model_json.hpp"
#include "results/software.hpp"
#include "results/words/commission_summary.hpp"

namespace wheelwright::python {

using commission::ParameterResult;

namespace {

struct CommissionObject {
  std::shared_ptr<const Commissioning> result;
  logs::LogReport data;
  Eigen::VectorXd estimate, standard_error, lower, upper;

  [[nodiscard]] bool has_model() const { return !result->model.facets.empty(); }
  [[nodiscard]] Json json() const { return results::to_json(*result, data, results::software()); }
};

std::unique_ptr<CommissionObject> made(Commissioning result, logs::LogReport data) {
  auto out = std::make_unique<CommissionObject>();
  out->result = std::make_shared<const Commissioning>(std::move(result));
  out->data = std::move(data);
  const auto p = static_cast<Eigen::Index>(out->result->parameters.size());
  out->estimate = out->standard_error = out->lower = out->upper = Eigen::VectorXd(p);
  for (Eigen::Index j = 0; j < p; ++j) {
    const ParameterResult& parameter = out->result->parameters[static_cast<std::size_t>(j)];
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    out->estimate[j] = parameter.estimate.value_or(nan);
    out->standard_error[j] = parameter.standard_error.value_or(nan);
    out->lower[j] = parameter.lower;
    out->upper[j] = parameter.upper;
  }
  return out;
}

std::unique_ptr<CommissionObject> run(LogObject& log, const RobotObject& robot, bool statistical, std::size_t outliers,
                                      std::pair<std::size_t, std::size_t> persistence, py::object progress) {
  commission::CommissionOptions options;
  options.noise_mode = statistical ? filter::NoiseMode::statistical : filter::NoiseMode::worst_case;
  options.outliers = outliers;
  options.persistence = {persistence.first, persistence.second};
  LongWork work(std::move(progress));
  options.progress = work.teller();
  return work.run([&] {
    const LogWalk walk(log);
    logs::require_columns(*log.source, robots::needed_columns(robot.robot));
    WatchedLog source(*log.source, work);
    Commissioning result = commission_robot(
        source, model::with_column_errors(robot.robot, logs::interpolation_errors(log.source->report())), options);
    return made(std::move(result), log.source->report());
  });
}

void bind_parameter(py::module_& m) {
  py::class_<ParameterResult>(m, "ParameterResult", "What commissioning found about one parameter of theta_L (20).")
      .def_property_readonly("name", [](const ParameterResult& p) { return p.parameter.name; })
      .def_property_readonly("unit", [](const ParameterResult& p) { return p.parameter.unit; })
      .def_property_readonly(
          "physical", [](const ParameterResult& p) { return p.parameter.physical; },
          "the physical quantity behind it, e.g. mass")
      .def_property_readonly(
          "excitation",
          [](const ParameterResult& p) { return files::word_of(results::kExcitationWords, p.excitation); },
          "identified, indistinct (not told from zero) or not_excited")
      .def_readonly("reason", &ParameterResult::reason, "why it is not identified, for people")
      .def_readonly("estimate", &ParameterResult::estimate, "None where the log does not show the parameter")
      .def_readonly("standard_error", &ParameterResult::standard_error, "honest under autocorrelated residuals")
      .def_readonly("lower", &ParameterResult::lower, "bound, in the sense of warrant")
      .def_readonly("upper", &ParameterResult::upper, "bound, in the sense of warrant")
      .def_property_readonly(
          "warrant", [](const ParameterResult& p) { return std::string(core::warrant_word(p.warrant)); },
          "what the bounds stand on: guaranteed, extrapolated or statistical")
      .def_readonly("chebyshev", &ParameterResult::chebyshev, "centre of the feasible set")
      .def_readonly("lower_is_prior", &ParameterResult::lower_is_prior, "the log does not tighten the prior's bound")
      .def_readonly("upper_is_prior", &ParameterResult::upper_is_prior)
      .def_readonly("estimate_inside", &ParameterResult::estimate_inside)
      .def("__repr__", [](const ParameterResult& p) {
        return "<wheelwright.ParameterResult " + p.parameter.name + ": " + files::json_text(Json(p.lower)) + " to " +
               files::json_text(Json(p.upper)) + " " + p.parameter.unit + ">";
      });
}

ModelObject read_commissioned(const std::filesystem::path& path) {
  return {std::make_shared<const OnlineModel>(read_model(path)), path.string()};
}

void bind_model(py::module_& m) {
  py::class_<ModelObject>(m, "Model", "What a detector carries: the on-line part of a commissioning. Immutable.")
      .def_property_readonly(
          "path", [](const ModelObject& o) { return o.path; }, "of its model.json; empty where it was made here")
      .def_property_readonly("robot",
                             [](const ModelObject& o) {
                               return RobotObject{o.model->robot, ""};
                             })
      .def_property_readonly(
          "parameters",
          [](const ModelObject& o) {
            std::vector<std::string> names;
            for (const model::Parameter& p : o.model->model.parameters) {
              names.push_back(p.name);
            }
            return names;
          },
          "names of the p parameters")
      .def_property_readonly(
          "outputs", [](const ModelObject& o) { return o.model->model.outputs; }, "names of the n channels")
      .def_property_readonly(
          "output_units", [](const ModelObject& o) { return o.model->model.output_units; }, "with torque as effort")
      .def_property_readonly(
          "columns", [](const ModelObject& o) { return o.model->measurement.columns(); },
          "columns of a sample, in the order of Detector.step()")
      .def_property_readonly(
          "nominal_step", [](const ModelObject& o) { return o.model->measurement.nominal_step; }, "s")
      .def_property_readonly(
          "filter",
          [](const ModelObject& o) {
            py::dict filter;
            filter["order"] = o.model->filter.order;
            filter["alpha"] = o.model->filter.alpha;
            filter["beta"] = o.model->filter.beta;
            return filter;
          },
          "order, alpha and beta (1/s) of (24)")
      .def_property_readonly(
          "estimate",
          [](const py::object& self) { return view(self.cast<const ModelObject&>().model->estimate, self); },
          "theta of (30), shape (p,), read-only view; the Chebyshev centre's where the log does not show a parameter")
      .def_property_readonly(
          "warrant", [](const ModelObject& o) { return std::string(core::warrant_word(o.model->warrant)); },
          "what bounds and thresholds stand on: guaranteed, extrapolated or statistical")
      .def_property_readonly(
          "assumptions",
          [](const ModelObject& o) { return to_python(results::assumptions_json(o.model->assumptions)); },
          "what is taken as given: a list of dicts with id, statement, declared_by, test, verdict and detail")
      .def_property_readonly(
          "feasible_set",
          [](const ModelObject& o) { return std::make_unique<SetObject>(Polytope(o.model->facets, o.model->box)); },
          "the set of all theta that the log allows")
      .def("__repr__", [](const ModelObject& o) {
        return "<wheelwright.Model of " + o.model->robot.name + ", " + std::to_string(o.model->model.p()) +
               " parameters>";
      });
  m.def("read_model", &read_commissioned, py::arg("path"),
        "Reads a model.json.\n\nRaises InputError, naming file and key, also where the file holds no model.");
}

}  // namespace

py::object commission_object(const Commissioning& result, const logs::LogReport& data) {
  return py::cast(made(result, data));
}

std::optional<Json> commission_json(const py::handle& object) {
  return py::isinstance<CommissionObject>(object) ? std::optional(object.cast<const CommissionObject&>().json())
                                                  : std::nullopt;
}

void bind_commission(py::module_& m) {
  bind_parameter(m);
  bind_model(m);
  py::class_<CommissionObject> bound(m, "Commission", "The result of commission(): model.json and the numbers in it.");
  bound
      .def_property_readonly(
          "status", [](const CommissionObject& c) { return files::word_of(results::kStatusWords, c.result->status); },
          "done, partial (bounds of some parameters are the prior's), empty (no theta explains the log), nothing, or "
          "contradicted (the log contradicts what a model takes for granted: contradictions)")
      .def_property_readonly(
          "contradictions", [](const CommissionObject& c) { return to_python(c.json().at("contradictions")); },
          "list of dicts: id, withdraws, subject, value, limit, sentence, next")
      .def_property_readonly(
          "robot",
          [](const CommissionObject& c) {
            return RobotObject{c.result->model.robot, ""};
          },
          "with what the log decided: noise, filter")
      .def_property_readonly("message", [](const CommissionObject& c) { return c.result->message; })
      .def_property_readonly("notes", [](const CommissionObject& c) { return c.result->notes; })
      .def_property_readonly("parameters", [](const CommissionObject& c) { return c.result->parameters; })
      .def_property_readonly(
          "model",
          [](const CommissionObject& c) {
            if (!c.has_model()) {
              throw Error("the commissioning gave no model: " + c.result->message);
            }
            return ModelObject{{c.result, &c.result->model}, ""};
          },
          "what a detector carries. Raises Error where the log gives no model")
      .def_property_readonly(
          "feasible_set", [](const CommissionObject& c) { return std::make_unique<SetObject>(c.result->feasible); },
          "the set with its certificates (Assumption 1)")
      .def_property_readonly(
          "estimate", [](const py::object& self) { return view(self.cast<const CommissionObject&>().estimate, self); },
          "theta of (30), shape (p,), read-only view; NaN where the log does not show a parameter")
      .def_property_readonly(
          "standard_error",
          [](const py::object& self) { return view(self.cast<const CommissionObject&>().standard_error, self); },
          "shape (p,), read-only view")
      .def_property_readonly(
          "lower", [](const py::object& self) { return view(self.cast<const CommissionObject&>().lower, self); },
          "lower bounds in the sense of warrant, shape (p,), read-only view")
      .def_property_readonly(
          "upper", [](const py::object& self) { return view(self.cast<const CommissionObject&>().upper, self); },
          "upper bounds in the sense of warrant, shape (p,), read-only view")
      .def_property_readonly(
          "warrant", [](const CommissionObject& c) { return std::string(core::warrant_word(c.result->model.warrant)); },
          "what bounds and thresholds stand on: guaranteed (declared sensor bounds, and no assumption that a test "
          "contradicts), extrapolated (noise bounds learnt from the log) or statistical")
      .def_property_readonly(
          "assumptions",
          [](const CommissionObject& c) { return to_python(results::assumptions_json(c.result->assumptions)); },
          "what is taken as given: a list of dicts with id, statement, declared_by, test, verdict and detail")
      .def_property_readonly("rank", [](const CommissionObject& c) { return c.result->rank; })
      .def_property_readonly("condition", [](const CommissionObject& c) { return c.result->condition; })
      .def_property_readonly(
          "summary", [](const CommissionObject& c) { return words::summary(*c.result); },
          "what the command line prints")
      .def(
          "to_dict", [](const CommissionObject& c) { return to_python(c.json()); },
          "The content of model.json (results/model.schema.json).")
      .def(
          "save",
          [](const CommissionObject& c, const std::filesystem::path& path) { files::write_json(path, c.json()); },
          py::arg("path"), "Writes model.json, whole or not at all.");
  tables_of(bound);
  m.def("commission", &run, py::arg("log"), py::arg("robot"), py::kw_only(), py::arg("statistical") = false,
        py::arg("outliers") = 0, py::arg("persistence") = std::pair<std::size_t, std::size_t>{1, 1},
        py::arg("progress") = py::none(),
        "From a log of fault-free driving to a model that a detector can carry.\n\n"
        "statistical: propagate declared sensor noise at a confidence of 99.9 % instead of in the worst case. "
        "outliers: instants that the feasible set may leave out. persistence: (k, n), an alarm is k of the last n "
        "instants outside. progress: called as progress(fraction, text).\n\n"
        "The interpreter's lock is released; Ctrl-C ends the work. Raises InputError or InvalidArgument for a log or "
        "robot that cannot be used; what the data say is in the result.");
}

}  // namespace wheelwright::python

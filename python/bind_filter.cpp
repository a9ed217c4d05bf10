// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <filesystem>
#include <optional>

#include <pybind11/stl/filesystem.h>
#include <nlohmann/json.hpp>

#include <wheelwright/commission/setting.hpp>
#include <wheelwright/core/check.hpp>
#include <wheelwright/identify/least_squares.hpp>
#include <wheelwright/inference/identification.hpp>
#include <wheelwright/logs/log_file.hpp>
#include <wheelwright/results/identification_json.hpp>
#include <wheelwright/robots/robot_file.hpp>

#include <wheelwright/results/software.hpp>
#include <wheelwright/words/identify_summary.hpp>
#include "arrays.hpp"
#include "long_work.hpp"
#include "module.hpp"

namespace wheelwright::python {
namespace {

struct RegressionObject {
  RegressionBlock rows;
  Model model;
  FilterDesign filter;
};

std::unique_ptr<RegressionObject> filtered(LogObject& log, const RobotObject& robot, const ModelObject* model,
                                           py::object progress) {
  LongWork work(std::move(progress));
  return work.run([&] {
    const LogWalk walk(log);
    auto out = std::make_unique<RegressionObject>();
    WatchedLog source(*log.source, work);
    if (model != nullptr) {
      const OnlineModel& m = *model->model;
      logs::require_columns(*log.source, m.measurement.columns());
      TorqueRows stream(source, RegressorFilter(m.model, m.filter, m.measurement, m.errors));
      out->rows = read_all(stream);
      out->model = m.model;
      out->filter = m.filter;
    } else {
      logs::require_columns(*log.source, robots::needed_columns(robot.robot));
      commission::SettingOptions options;
      options.progress = work.teller();
      const commission::Setting setting = commission::settle(
          source, model::with_column_errors(robot.robot, logs::interpolation_errors(log.source->report())), options);
      TorqueRows stream = commission::make_rows(source, setting, setting.declared);
      out->rows = read_all(stream);
      out->model = setting.model;
      out->filter = setting.filter;
    }
    return out;
  });
}

py::array by_instant(const RegressionObject& r, const core::RowMatrix& m, py::handle owner) {
  const auto n = static_cast<py::ssize_t>(r.rows.outputs);
  return view(m.data(), {m.rows() / std::max<py::ssize_t>(n, 1), n, m.cols()}, owner);
}

py::array by_instant(const RegressionObject& r, const Eigen::VectorXd& v, py::handle owner) {
  const auto n = static_cast<py::ssize_t>(r.rows.outputs);
  return view(v.data(), {v.size() / std::max<py::ssize_t>(n, 1), n}, owner);
}

identify::LeastSquaresFit fit(const Doubles& Y, const Doubles& y) {
  check::that(Y.ndim() == 2, "Y", "shape (rows, p)");
  const auto left = values(y, "y", Y.shape(0));
  const auto rows = static_cast<std::size_t>(Y.shape(0)), p = static_cast<std::size_t>(Y.shape(1));
  for (std::size_t i = 0; i < rows * p; ++i) {
    check::finite(Y.data()[i], "Y");
  }
  for (const double each : left) {
    check::finite(each, "y");
  }
  check::that(p > 0, "Y", "a column");
  const py::gil_scoped_release unlocked;
  identify::LeastSquares squares(p);
  RegressionBlock block;
  for (std::size_t first = 0; first < rows; first += 4096) {
    const std::size_t count = std::min<std::size_t>(4096, rows - first);
    block.resize(count, 1, p);
    std::copy_n(Y.data() + first * p, count * p, block.Y.data());
    std::copy_n(left.data() + first, count, block.y.data());
    block.dY.setZero();
    block.dy.setZero();
    squares.add(block);
  }
  return squares.solve();
}

struct IdentificationObject {
  inference::Identification result;
  logs::LogReport data;
  std::uint64_t seed = 1;
  [[nodiscard]] Json json() const { return results::to_json(result, data, results::software(), seed); }
};

std::unique_ptr<IdentificationObject> identify_log(LogObject& log, const RobotObject& robot, bool shapes,
                                                   std::uint64_t seed, py::object progress) {
  LongWork work(std::move(progress));
  inference::IdentificationOptions options;
  options.seed = seed;
  options.shapes = shapes;
  options.progress = work.teller();
  return work.run([&] {
    const LogWalk walk(log);
    const logs::RecordedLog& given = *log.source;
    const std::vector<std::string> needed = robots::needed_columns(robot.robot);
    const bool efforts = std::any_of(needed.begin(), needed.end(),
                                     [&](const std::string& name) { return given.find(name).has_value(); });
    if (efforts || !model::on_two_wheels(robot.robot) || !given.find("theta")) {
      logs::require_columns(given, needed);
    }
    WatchedLog source(*log.source, work);
    auto out = std::make_unique<IdentificationObject>();
    out->result = inference::identify(
        source, model::with_column_errors(robot.robot, logs::interpolation_errors(given.report())), options);
    out->data = log.source->report();
    out->seed = seed;
    return out;
  });
}

}  // namespace

void bind_filter(py::module_& m) {
  py::class_<RegressionObject>(m, "Regression",
                               "A filtered log as y = Y theta + e (25): K instants, n outputs, p parameters. Arrays "
                               "are read-only views.")
      .def_property_readonly(
          "Y",
          [](const py::object& self) {
            const auto& r = self.cast<const RegressionObject&>();
            return by_instant(r, r.rows.Y, self);
          },
          "filtered regressor, shape (K, n, p)")
      .def_property_readonly(
          "dY",
          [](const py::object& self) {
            const auto& r = self.cast<const RegressionObject&>();
            return by_instant(r, r.rows.dY, self);
          },
          "bound >= 0 on the error of Y from declared noise (with `model`: the model's), shape (K, n, p)")
      .def_property_readonly(
          "y",
          [](const py::object& self) {
            const auto& r = self.cast<const RegressionObject&>();
            return by_instant(r, r.rows.y, self);
          },
          "filtered torque (28), shape (K, n)")
      .def_property_readonly(
          "dy",
          [](const py::object& self) {
            const auto& r = self.cast<const RegressionObject&>();
            return by_instant(r, r.rows.dy, self);
          },
          "bound >= 0 on the error of y, shape (K, n)")
      .def_property_readonly(
          "t", [](const py::object& self) { return view(self.cast<const RegressionObject&>().rows.t, self); },
          "s, shape (K,)")
      .def_property_readonly(
          "row",
          [](const RegressionObject& r) {
            return copy(std::vector<std::int64_t>(r.rows.sample.begin(), r.rows.sample.end()));
          },
          "rows of the log, shape (K,)")
      .def_property_readonly("outputs", [](const RegressionObject& r) { return r.model.outputs; })
      .def_property_readonly("parameters",
                             [](const RegressionObject& r) {
                               std::vector<std::string> names;
                               for (const model::Parameter& p : r.model.parameters) {
                                 names.push_back(p.name);
                               }
                               return names;
                             })
      .def_property_readonly("filter", [](const RegressionObject& r) {
        py::dict filter;
        filter["order"] = r.filter.order;
        filter["alpha"] = r.filter.alpha;
        filter["beta"] = r.filter.beta;
        return filter;
      });
  m.def("filter_log", &filtered, py::arg("log"), py::arg("robot"), py::arg("model") = nullptr, py::kw_only(),
        py::arg("progress") = py::none(),
        "The rows of a log in memory: filter constants of the robot file or chosen as commission() does; with `model` "
        "exactly those that its detector sees. The interpreter's lock is released.");
  py::class_<identify::LeastSquaresFit>(m, "LeastSquaresFit", "See least_squares().")
      .def_property_readonly(
          "estimate", [](const identify::LeastSquaresFit& f) { return copy(f.estimate); }, "shape (p,)")
      .def_property_readonly(
          "inverse_gram",
          [](const identify::LeastSquaresFit& f) {
            const core::RowMatrix rows = f.inverse_gram;
            return py::array_t<double>({rows.rows(), rows.cols()}, rows.data());
          },
          "(Y'Y)^-1, shape (p, p)")
      .def_readonly("rank", &identify::LeastSquaresFit::rank)
      .def_readonly("condition", &identify::LeastSquaresFit::condition, "of the columns scaled to unit length")
      .def_readonly("rss", &identify::LeastSquaresFit::weighted_rss, "sum of squared residuals");
  m.def("least_squares", &fit, py::arg("Y"), py::arg("y"),
        "min |y - Y theta|^2 by sequential QR. Y of shape (rows, p), y (rows,). The interpreter's lock is released.");
  py::class_<IdentificationObject>(m, "Identification", "What `wheelwright identify` says of a log.")
      .def_property_readonly("summary", [](const IdentificationObject& i) { return words::summary(i.result); })
      .def_property_readonly("notes", [](const IdentificationObject& i) { return i.result.notes; })
      .def(
          "to_dict", [](const IdentificationObject& i) { return to_python(i.json()); },
          "The content of identification.json (results/identification.schema.json).")
      .def(
          "save",
          [](const IdentificationObject& i, const std::filesystem::path& path) { files::write_json(path, i.json()); },
          py::arg("path"), "Writes identification.json, whole or not at all.");
  m.def("identify", &identify_log, py::arg("log"), py::arg("robot"), py::kw_only(), py::arg("shapes") = true,
        py::arg("seed") = 1, py::arg("progress") = py::none(),
        "Everything that a log says about the parameters, without thresholds, as `wheelwright identify` does.\n\n"
        "shapes: look for delay, lags and Stribeck speed too. seed: of bootstrap and signs. The interpreter's lock is "
        "released; Ctrl-C ends the work.");
}

}  // namespace wheelwright::python

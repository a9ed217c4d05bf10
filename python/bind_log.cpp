// SPDX-License-Identifier: Apache-2.0
#include "python/arrays.hpp"

#include <algorithm>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include <fmt/format.h>
#include <pybind11/stl/filesystem.h>
#include <nlohmann/json.hpp>

#include "commission/identification.hpp"
#include "commission/setting.hpp"
#include "commission/setting_rows.hpp"
#include "core/check.hpp"
#include "detector/multiscale/scale_detector.hpp"
#include "formats/files/bytes.hpp"
#include "formats/files/words.hpp"
#include "formats/logs/csv.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/logs/recorded_log.hpp"
#include "formats/logs/row_log.hpp"
#include "formats/robots/robot_file.hpp"
#include "identify/least_squares.hpp"
#include "python/module.hpp"
#include "results/identification_json.hpp"
#include "results/software.hpp"
#include "results/words/identification_summary.hpp"

namespace wheelwright::python {
namespace {

constexpr const char* kName = "arrays";

// Named columns in somebody else's memory, time first.
struct Columns {
  std::vector<std::string> names, header;  // names: time apart; header: as they were given
  std::vector<std::span<const double>> values;
};

class ArrayWalk final : public logs::RowWalk {
 public:
  // `pick` are the columns to read: the time, then those of `names`.
  ArrayWalk(const Columns& columns, std::vector<std::size_t> pick, const std::vector<std::string>& names,
            double longest_step, logs::LogReport* report)
      : columns_(&columns), pick_(std::move(pick)), cleaner_(names, report), row_(pick_.size()) {
    cleaner_.set_longest_step(longest_step);
    cleaner_.begin_file(std::string(kName) + ", row ");
  }

  bool next(logs::RowOutcome& outcome) override {
    if (k_ == columns_->values.front().size()) {
      return false;
    }
    for (std::size_t c = 0; c < row_.size(); ++c) {
      row_[c] = columns_->values[pick_[c]][k_];
    }
    outcome = cleaner_.clean(row_, k_++);
    return true;
  }
  [[nodiscard]] double t() const override { return cleaner_.t(); }
  [[nodiscard]] const double* values() const override { return row_.data() + 1; }
  void describe(logs::LogFileReport& file) const override {
    files::Xxh64 hash;
    for (const std::size_t c : pick_) {
      hash.update(reinterpret_cast<const char*>(columns_->values[c].data()), columns_->values[c].size_bytes());
      file.bytes += columns_->values[c].size_bytes();
    }
    file.hash = hash.text();
    file.packing = "plain";
    file.header = columns_->header;
  }

 private:
  const Columns* columns_;
  std::vector<std::size_t> pick_;
  logs::RowCleaner cleaner_;
  std::vector<double> row_;
  std::size_t k_ = 0;
};

class ArrayFile final : public logs::RowFile {
 public:
  ArrayFile(std::shared_ptr<std::vector<Doubles>> kept, Columns columns)
      : kept_(std::move(kept)), columns_(std::move(columns)) {}
  [[nodiscard]] std::string path() const override { return kName; }
  [[nodiscard]] const std::vector<std::string>& columns() const override { return columns_.names; }
  [[nodiscard]] std::unique_ptr<logs::RowWalk> open(const std::vector<std::string>& names, double longest_step,
                                                    logs::LogReport* report) override {
    std::vector<std::size_t> pick = {0};
    for (const std::string& name : names) {
      const auto at = std::find(columns_.names.begin(), columns_.names.end(), name);
      pick.push_back(static_cast<std::size_t>(at - columns_.names.begin()) + 1);
    }
    return std::make_unique<ArrayWalk>(columns_, std::move(pick), names, longest_step, report);
  }

 private:
  std::shared_ptr<std::vector<Doubles>> kept_;  // what the columns are views of
  Columns columns_;
};

// The names of `columns` as a CSV header writes them.
std::string header_line(const std::vector<std::string>& names) {
  std::string line;
  for (const std::string& name : names) {
    line += line.empty() ? "\"" : ",\"";
    for (const char c : name) {
      line += c == '"' ? std::string("\"\"") : std::string(1, c);
    }
    line += '"';
  }
  return line;
}

// `given` as doubles; times of numpy and pandas, of the column of time, as seconds since 1970 or of a span.
Doubles numbers_of(const py::handle& given, const std::string& name, bool is_time) {
  const py::array array = py::array::ensure(given);
  const char kind = array ? array.dtype().kind() : '?';
  if (is_time && (kind == 'M' || kind == 'm')) {
    const char* const nanoseconds = kind == 'M' ? "datetime64[ns]" : "timedelta64[ns]";
    const Doubles whole = Doubles::ensure(array.attr("astype")(nanoseconds).attr("astype")("int64"));
    Doubles seconds(std::vector<py::ssize_t>(whole.shape(), whole.shape() + whole.ndim()));
    std::transform(whole.data(), whole.data() + whole.size(), seconds.mutable_data(), [](double at) {
      constexpr double kNotATime = -9.2e18;
      return at < kNotATime ? std::numeric_limits<double>::quiet_NaN() : 1e-9 * at;
    });
    return seconds;
  }
  if (std::string_view("fiubO").find(kind) != std::string_view::npos) {
    if (Doubles numbers = Doubles::ensure(given)) {
      return numbers;
    }
  }
  PyErr_Clear();
  const std::string type = array ? py::str(array.dtype()).cast<std::string>() : "of no array";
  throw InvalidArgument(fmt::format("column {} of type {}: expected {}", name, type,
                                    is_time ? "numbers, in s, or times of numpy or pandas" : "real numbers"));
}

}  // namespace

std::unique_ptr<logs::RecordedLog> array_log(const py::dict& columns, const logs::CsvOptions& options) {
  std::vector<std::string> given;
  std::vector<py::handle> arrays;
  for (const auto& [name, array] : columns) {
    given.push_back(py::cast<std::string>(py::str(name)));
    arrays.push_back(array);
  }
  check::that(!given.empty(), "columns", "at least the time and one column");
  const logs::CsvHeader header = logs::read_csv_header(header_line(given), options, kName);
  std::vector<std::pair<std::size_t, std::string>> order;
  for (const auto& [name, field] : header.found) {
    if (name != "t") {
      order.emplace_back(field, name);
    }
  }
  std::sort(order.begin(), order.end());
  order.insert(order.begin(), {header.found.at("t"), "t"});
  const std::shared_ptr<std::vector<Doubles>> kept(new std::vector<Doubles>, [](std::vector<Doubles>* held) {
    const py::gil_scoped_acquire lock;
    delete held;
  });
  Columns out;
  for (const auto& [field, name] : order) {
    const Doubles array = numbers_of(arrays[field], given[field], name == "t");
    check_shape(array, {kept->empty() ? -1 : kept->front().size()}, "column " + given[field]);
    if (!kept->empty()) {
      out.names.push_back(name);
    }
    out.values.emplace_back(array.data(), static_cast<std::size_t>(array.size()));
    kept->push_back(array);
  }
  out.header = std::move(given);
  std::vector<std::unique_ptr<logs::RowFile>> files;
  files.push_back(std::make_unique<ArrayFile>(kept, std::move(out)));
  const py::gil_scoped_release unlocked;
  return std::make_unique<logs::RowLog>(
      std::move(files), logs::RowLogOptions{options.block_rows, options.min_rows, 0});  // in memory already
}

std::vector<std::string> LogObject::paths() const {
  std::vector<std::string> names;
  for (const logs::LogFileReport& file : source->report().files) {
    names.push_back(file.path);
  }
  return names;
}

std::string LogObject::name() const { return core::listed(paths()); }

LogWalk::LogWalk(LogObject& log) : log_(&log) {
  check::that(!log.walked.exchange(true), "log " + log.name(),
              "one that no other call walks at the same time: read it once more for that");
}

namespace {

using Path = std::filesystem::path;
using Paths = std::variant<Path, std::vector<Path>>;

}  // namespace

robots::ColumnMap columns_of(const RobotObject& robot) {
  return robot.path.empty() ? robots::ColumnMap{} : robots::read_columns(robot.path, logs::log_column_names());
}

logs::LogOptions reader_options(const RobotObject* robot, const std::map<std::string, std::string>& map,
                                const std::vector<std::string>& extra) {
  logs::LogOptions options;
  options.map = map;
  options.extra = extra;
  for (const auto& [name, column] : map) {
    std::vector<std::string> names = extra;
    for (const logs::LogColumn& each : logs::log_columns()) {
      names.push_back(each.name);
    }
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      throw InputError("map: " + files::shown(name) + " is no column of a log: expected one of " + core::listed(names) +
                       files::did_you_mean(name, names));
    }
  }
  if (robot != nullptr) {
    options.only = robots::useful_columns(robot->robot);
    options.heading_offset = robot->robot.heading_offset;
    options.clock = robot->robot.clock;
  }
  return options;
}

namespace {

std::unique_ptr<LogObject> read_recorded(const Paths& paths, const RobotObject* robot,
                                         const std::map<std::string, std::string>& map,
                                         const std::vector<std::string>& extra, const std::vector<Path>& msg_path,
                                         bool trust) {
  logs::LogOptions options = reader_options(robot, map, extra);
  if (robot != nullptr) {
    for (const auto& [name, column] : columns_of(*robot)) {
      if (options.map.emplace(name, column).second) {
        options.or_by_name.push_back(name);
      }
    }
  }
  options.msg_path = msg_path;
  options.trust = trust;
  options.leaps = false;
  const auto files = std::holds_alternative<Path>(paths) ? std::vector<Path>{std::get<Path>(paths)}
                                                         : std::get<std::vector<Path>>(paths);
  const py::gil_scoped_release unlocked;
  auto log = std::make_unique<LogObject>();
  log->source = logs::open_log(files, options);
  return log;
}

std::unique_ptr<LogObject> of_arrays(const py::object& columns, const RobotObject* robot,
                                     const std::map<std::string, std::string>& map,
                                     const std::vector<std::string>& extra) {
  auto log = std::make_unique<LogObject>();
  log->source = array_log(py::dict(columns), reader_options(robot, map, extra));
  return log;
}

LogTable table_of(LogObject& log) {
  LongWork work{py::none()};
  return work.run([&] {
    const LogWalk walk(log);
    WatchedLog source(*log.source, work);
    return read_all(source);
  });
}

}  // namespace

void bind_log(py::module_& m) {
  py::class_<LogObject>(m, "Log",
                        "A cleaned log: times in s, columns of the log contract in SI units. It is read anew, in "
                        "blocks, by each call that takes it; it serves one call at a time.")
      .def(py::init(&of_arrays), py::arg("columns"), py::arg("robot") = nullptr,
           py::arg("map") = std::map<std::string, std::string>{}, py::arg("extra") = std::vector<std::string>{},
           "A log of numpy columns by name (a dict, or what dict() takes: a pandas.DataFrame does), each of shape "
           "(rows,), one of them the time (s, or times of numpy or pandas).\n\n"
           "float64 arrays that are contiguous are not copied but kept and read where they lie: leave their contents "
           "alone as long as the log is used. Others are converted. Rows are cleaned as those of a file are: rows with "
           "NaN are dropped, gaps and resets of time begin segments, theta is unwrapped; see notes.\n\n"
           "With `robot` only the columns that it can use are read. `map` gives column names that no spelling covers, "
           "e.g. {'omega_r': 'wheel_2'}. `extra` names further columns to keep.\n\n"
           "Raises InputError for what cannot be used, InvalidArgument for shapes.")
      .def_property_readonly("paths", &LogObject::paths)
      .def_property_readonly(
          "columns", [](const LogObject& l) { return l.source->columns(); }, "names of the columns, time apart")
      .def_property_readonly(
          "rows", [](const LogObject& l) { return l.source->report().rows; }, "usable rows")
      .def_property_readonly("segments", [](const LogObject& l) { return l.source->report().segments; })
      .def_property_readonly(
          "seconds", [](const LogObject& l) { return l.source->report().seconds; }, "sum over the segments, s")
      .def_property_readonly(
          "median_step", [](const LogObject& l) { return l.source->median_step(); }, "s")
      .def_property_readonly(
          "notes", [](const LogObject& l) { return logs::sentences(l.source->report()); },
          "what reading repaired or split, a sentence each")
      .def(
          "to_arrays", [](LogObject& l) { return arrays_of(table_of(l)); },
          "All clean rows as new arrays of shape (rows,), by name, 't' among them (theta is unwrapped).")
      .def(
          "segment_starts", [](LogObject& l) { return copy(table_of(l).segment_starts); },
          "Rows at which segments begin, ascending: nothing is filtered across them.")
      .def(
          "save",
          [](LogObject& l, const Path& path) {
            const LogTable table = table_of(l);
            const py::gil_scoped_release unlocked;
            logs::write_csv(path, table);
          },
          py::arg("path"), "Writes the clean rows as CSV (.gz, .zst), whole or not at all.")
      .def("__len__", [](const LogObject& l) { return l.source->report().rows; })
      .def("__repr__", [](const LogObject& l) {
        return "<wheelwright.Log " + l.name() + ": " + std::to_string(l.source->report().rows) + " rows>";
      });
  m.def("read_log", &read_recorded, py::arg("paths"), py::arg("robot") = nullptr,
        py::arg("map") = std::map<std::string, std::string>{}, py::arg("extra") = std::vector<std::string>{},
        py::arg("msg_path") = std::vector<Path>{}, py::arg("trust") = false,
        "Reads one log (CSV, also .gz and .zst; rosbag2 in MCAP or SQLite; HDF5), or several as one (each begins a "
        "segment), in bounded memory.\n\n"
        "With `robot` only the columns that it can use are read, as the command line does. `map` gives column names "
        "that no spelling covers, e.g. {'omega_r': 'wheel_2'}, or fields of bags (TOPIC.FIELD). `extra` names further "
        "columns to keep. `msg_path`: directories with definitions of messages, for bags that do not bring their "
        "own. `trust`: whether the log may reach for files outside of itself and its directory (links, HDF5's external "
        "and virtual datasets, very large journals and packed files).\n\n"
        "Raises InputError, naming file, place, value and what was expected.");
}

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
  commission::Identification result;
  logs::LogReport data;
  std::uint64_t seed = 1;
  [[nodiscard]] Json json() const { return results::to_json(result, data, results::software(), seed); }
};

std::unique_ptr<IdentificationObject> identify_log(LogObject& log, const RobotObject& robot, bool shapes,
                                                   std::uint64_t seed, py::object progress) {
  LongWork work(std::move(progress));
  commission::IdentificationOptions options;
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
    out->result = commission::identify(
        source, model::with_column_errors(robot.robot, logs::interpolation_errors(given.report())), options);
    out->data = log.source->report();
    out->seed = seed;
    return out;
  });
}

}  // namespace

void bind_filter(py::module_& m) {
  py::class_<RegressionObject> regression(
      m, "Regression",
      "A filtered log as y = Y theta + e (25): K instants, n outputs, p parameters. Arrays are read-only views.");
  regression
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
  tables_of(regression);
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
  py::class_<IdentificationObject> identification(m, "Identification", "What `wheelwright identify` says of a log.");
  identification
      .def_property_readonly("summary", [](const IdentificationObject& i) { return words::summary(i.result); })
      .def_property_readonly("notes", [](const IdentificationObject& i) { return i.result.notes; })
      .def(
          "to_dict", [](const IdentificationObject& i) { return to_python(i.json()); },
          "The content of identification.json (results/identification.schema.json).")
      .def(
          "save",
          [](const IdentificationObject& i, const std::filesystem::path& path) { files::write_json(path, i.json()); },
          py::arg("path"), "Writes identification.json, whole or not at all.");
  tables_of(identification);
  m.def("identify", &identify_log, py::arg("log"), py::arg("robot"), py::kw_only(), py::arg("shapes") = true,
        py::arg("seed") = 1, py::arg("progress") = py::none(),
        "Everything that a log says about the parameters, without thresholds, as `wheelwright identify` does.\n\n"
        "shapes: look for delay, lags and Stribeck speed too. seed: of bootstrap and signs. The interpreter's lock is "
        "released; Ctrl-C ends the work.");
}

}  // namespace wheelwright::python

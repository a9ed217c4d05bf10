// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <map>
#include <optional>
#include <variant>

#include <pybind11/stl/filesystem.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/files/words.hpp>
#include <wheelwright/logs/csv.hpp>
#include <wheelwright/logs/log_file.hpp>
#include <wheelwright/logs/recorded_log.hpp>

#include <wheelwright/results/software.hpp>
#include <wheelwright/robots/robot_file.hpp>
#include "array_log.hpp"
#include "arrays.hpp"
#include "long_work.hpp"
#include "module.hpp"

namespace wheelwright::python {

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
  }
  return options;
}

std::unique_ptr<LogObject> read_recorded(const Paths& paths, const RobotObject* robot,
                                         const std::map<std::string, std::string>& map,
                                         const std::vector<std::string>& extra, const std::vector<Path>& msg_path) {
  logs::LogOptions options = reader_options(robot, map, extra);
  options.msg_path = msg_path;
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
           "(rows,), one "
           "of them the time (s).\n\n"
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
        py::arg("msg_path") = std::vector<Path>{},
        "Reads one log (CSV, also .gz and .zst; rosbag2 in MCAP or SQLite; HDF5), or several as one (each begins a "
        "segment), in bounded memory.\n\n"
        "With `robot` only the columns that it can use are read, as the command line does. `map` gives column names "
        "that no spelling covers, e.g. {'omega_r': 'wheel_2'}, or fields of bags (TOPIC.FIELD). `extra` names further "
        "columns to keep. `msg_path`: directories with definitions of messages, for bags that do not bring their "
        "own.\n\n"
        "Raises InputError, naming file, place, value and what was expected.");
}

}  // namespace wheelwright::python

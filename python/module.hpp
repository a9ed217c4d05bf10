// SPDX-License-Identifier: Apache-2.0
/// \file
/// The parts of the extension module `wheelwright._core`, and what they share: work that takes long (without the
/// interpreter's lock, with progress, stopped by Ctrl-C).
#pragma once

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <pybind11/functional.h>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "bounds/feasible_set.hpp"
#include "core/log.hpp"
#include "detector/detector_options.hpp"
#include "detector/learnt_model.hpp"
#include "formats/files/json.hpp"
#include "formats/logs/log_file.hpp"
#include "formats/logs/recorded_log.hpp"
#include "formats/robots/robot_file.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {
struct Commissioning;
}  // namespace wheelwright::commission

namespace wheelwright::python {

namespace py = pybind11;

/// One piece of long work. Made and run with the interpreter's lock, which is given up while it runs.
class LongWork {
 public:
  /// `progress` is None or is called as progress(fraction, text), with the lock, on the thread that works.
  explicit LongWork(py::object progress) : progress_(std::move(progress)) {}

  /// What a module of the toolkit is to be told with.
  [[nodiscard]] std::function<void(std::string_view, double)> teller() {
    return [this](std::string_view text, double share) { tell(text, share); };
  }

  /// Calls Python: `call()` with the lock. An exception there ends the work, and run() throws it.
  template <typename Call>
  auto ask(const Call& call) -> decltype(call());

  /// Lets a signal's handler run, if a tenth of a second has passed since the last time; what it raises ends the work.
  void breathe();

  /// The result of work(), which runs without the lock.
  template <typename Work>
  auto run(const Work& work) -> decltype(work());

 private:
  // Ends the work; the Python exception waits in failure_.
  struct Stopped {};

  void tell(std::string_view text, double share);

  py::object progress_;
  std::optional<py::error_already_set> failure_;  // touched with the lock only
  std::mutex watch_;
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// A log that breathes between its blocks.
class WatchedLog final : public LogSource {
 public:
  WatchedLog(LogSource& log, LongWork& work) : log_(&log), work_(&work) {}
  [[nodiscard]] const std::vector<std::string>& columns() const override { return log_->columns(); }
  bool next(LogBlock& block) override {
    work_->breathe();
    return log_->next(block);
  }
  void rewind() override { log_->rewind(); }
  [[nodiscard]] double median_step() const override { return log_->median_step(); }

 private:
  LogSource* log_;
  LongWork* work_;
};

template <typename Call>
auto LongWork::ask(const Call& call) -> decltype(call()) {
  const py::gil_scoped_acquire lock;
  if (failure_) {
    throw Stopped{};
  }
  try {
    return call();
  } catch (py::error_already_set& error) {
    failure_.emplace(error);
  }
  throw Stopped{};
}

template <typename Work>
auto LongWork::run(const Work& work) -> decltype(work()) {
  std::optional<decltype(work())> result;
  try {
    const py::gil_scoped_release unlocked;
    result.emplace(work());
  } catch (...) {
    if (!failure_) {
      throw;
    }
  }
  // Whatever the modules made of Stopped, the Python exception is what happened.
  if (failure_) {
    throw py::error_already_set(*failure_);
  }
  return std::move(*result);
}

void bind_robot(py::module_& m);
void bind_log(py::module_& m);
void bind_filter(py::module_& m);
void bind_bounds(py::module_& m);
void bind_commission(py::module_& m);
void bind_detector(py::module_& m);
void bind_margins(py::module_& m);
void bind_gap(py::module_& m);
void bind_sim(py::module_& m);
void bind_doctor(py::module_& m);
void bind_study(py::module_& m);

/// A robot, and how its file was named (empty for one made in Python).
struct RobotObject {
  Robot robot;
  std::string path;
};

/// A log as Python holds it.
struct LogObject {
  std::unique_ptr<logs::RecordedLog> source;
  std::atomic<bool> walked = false;  ///< a call is at it: see LogWalk

  /// Its files as they were named; "arrays" for a log that came from none.
  [[nodiscard]] std::vector<std::string> paths() const;
  /// The same in one line.
  [[nodiscard]] std::string name() const;
};

/// The right to walk a log, which serves one call at a time.
class LogWalk {
 public:
  /// Throws InvalidArgument where another call is at it.
  explicit LogWalk(LogObject& log);
  ~LogWalk() { log_->walked = false; }
  LogWalk(const LogWalk&) = delete;
  LogWalk& operator=(const LogWalk&) = delete;

 private:
  LogObject* log_;
};

/// A model that a detector can carry, and how its file was named (empty where it was commissioned in this process).
struct ModelObject {
  std::shared_ptr<const OnlineModel> model;
  std::string path;
};

/// A set { θ : Aθ <= b } in a box, or the proof that it is empty.
struct SetObject {
  explicit SetObject(Polytope set);
  explicit SetObject(FeasibleSet set);
  /// Throws InvalidArgument where the set is empty.
  [[nodiscard]] const Polytope& polytope() const;

  FeasibleSet set;
  core::RowMatrix A;     ///< a facet a row
  Eigen::VectorXd b;     ///< right-hand sides
  core::RowMatrix hull;  ///< p × 2: lower, upper
};

/// `value` as dict, list, str, float, int, bool or None, exactly what a reader of its JSON text gets: NaN and infinity
/// are None.
[[nodiscard]] py::object to_python(const Json& value);

/// Where the file of `robot` says that its logs have their columns; empty for a robot that is of no file.
[[nodiscard]] robots::ColumnMap columns_of(const RobotObject& robot);

/// Options of a reader for the columns that `robot` (nullptr: any) can use. Throws InputError where `map` names none of
/// the log contract.
[[nodiscard]] logs::LogOptions reader_options(const RobotObject* robot, const std::map<std::string, std::string>& map,
                                              const std::vector<std::string>& extra);

/// k of n.
using Rule = std::optional<std::pair<std::size_t, std::size_t>>;

/// Throws InvalidArgument for words that are none.
[[nodiscard]] detector::DetectorOptions options_of(const std::string& set, const std::string& test,
                                                   const Rule& persistence, const std::string& residual = "d1");

/// A Commission of `result`, made of a log with the report `data`.
[[nodiscard]] py::object commission_object(const commission::Commissioning& result, const logs::LogReport& data);

/// The model.json of a Commission; nothing for another object.
[[nodiscard]] std::optional<Json> commission_json(const py::handle& object);

/// The gap.json of a Diagnosis. Throws InvalidArgument for another object.
[[nodiscard]] Json diagnosis_json(const py::handle& object);

/// Adds to_dataframe() and what notebooks show, as the package's module _tables has them.
template <typename Class>
void tables_of(Class& bound) {
  bound
      .def(
          "to_dataframe",
          [](const py::object& self) { return py::module_::import("wheelwright._tables").attr("frame")(self); },
          "Its table as a pandas.DataFrame. Raises Error where pandas is not installed.")
      .def("_repr_html_",
           [](const py::object& self) { return py::module_::import("wheelwright._tables").attr("html")(self); })
      .def("__repr__",
           [](const py::object& self) { return py::module_::import("wheelwright._tables").attr("line")(self); });
}

/// Adds summary, to_dict(), save() and tables_of() to a result with the members `json` and `summary`, the content of
/// `kind`.json.
template <typename Class>
void result_of(Class& bound, const std::string& kind) {
  using Object = typename Class::type;
  const std::string content = "The content of " + kind + ".json (results/" + kind + ".schema.json).";
  const std::string writes = "Writes " + kind + ".json, whole or not at all.";
  bound
      .def_property_readonly(
          "summary", [](const Object& o) { return o.summary; }, "what the command line prints")
      .def(
          "to_dict", [](const Object& o) { return to_python(o.json); }, content.c_str())
      .def(
          "save", [](const Object& o, const std::filesystem::path& path) { files::write_json(path, o.json); },
          py::arg("path"), writes.c_str());
  tables_of(bound);
}

/// Adds these keys of `json` as attributes.
template <typename Class>
void members_of(Class& bound, const std::vector<const char*>& keys) {
  using Object = typename Class::type;
  for (const char* const key : keys) {
    bound.def_property_readonly(
        key, [key](const Object& o) { return to_python(o.json.at(key)); }, "as in to_dict()");
  }
}

/// JSON of `json.dumps(value)`, parsed. Throws InvalidArgument, naming `what`, where it cannot be written.
[[nodiscard]] Json to_json(const py::handle& value, const std::string& what);

}  // namespace wheelwright::python

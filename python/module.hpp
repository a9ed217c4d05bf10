// SPDX-License-Identifier: Apache-2.0
/// \file
/// The parts of the extension module `wheelwright._core`, and what they share: work that takes long (without the
/// interpreter's lock, with progress, stopped by Ctrl-C).
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
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

#include <wheelwright/bounds/feasible_set.hpp>
#include <wheelwright/commission/commission.hpp>
#include <wheelwright/core/log.hpp>
#include <wheelwright/files/json.hpp>
#include <wheelwright/logs/recorded_log.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright::python {

namespace py = pybind11;

/// One piece of long work. Made and run with the interpreter's lock, which is given up while it runs.
class LongWork {
 public:
  /// `progress` is None or is called as progress(fraction, text), with the lock, on the thread that works.
  explicit LongWork(py::object progress) : progress_(std::move(progress)) {}

  /// What a room of the toolkit is to be told with.
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
  // Whatever the rooms made of Stopped, the Python exception is what happened.
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

/// JSON of `json.dumps(value)`, parsed. Throws InvalidArgument, naming `what`, where it cannot be written.
[[nodiscard]] Json to_json(const py::handle& value, const std::string& what);

}  // namespace wheelwright::python

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The parts of the extension module `wheelwright._core`, and what they share.
#pragma once

#include <atomic>
#include <memory>
#include <string>
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

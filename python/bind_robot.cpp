// SPDX-License-Identifier: Apache-2.0
#include <filesystem>

#include <pybind11/stl/filesystem.h>
#include <nlohmann/json.hpp>

#include <wheelwright/robots/robot_file.hpp>

#include "module.hpp"

namespace wheelwright::python {
namespace {

RobotObject read_file(const std::filesystem::path& path) { return {read_robot(path), path.string()}; }

RobotObject from_keys(const py::kwargs& keys) { return {robots::robot_from_json(to_json(keys, "Robot"), "Robot"), ""}; }

py::list parameters(const RobotObject& r) {
  py::list out;
  for (const model::Parameter& p : model::make_model(r.robot).parameters) {
    py::dict row;
    row["name"] = p.name;
    row["unit"] = p.unit;
    row["physical"] = p.physical;
    row["physical_unit"] = p.physical_unit;
    row["per_physical"] = p.per_physical;
    out.append(std::move(row));
  }
  return out;
}

}  // namespace

void bind_robot(py::module_& m) {
  py::class_<RobotObject>(m, "Robot", "What is known of a robot before its first drive: the robot file. Immutable.")
      .def(py::init(&from_keys),
           "Robot(wheel_radius=0.0975, track_width=0.381, noise={...}, ...): the keys of a robot file, SI units.\n\n"
           "Raises InputError, naming the key, for unknown keys, wrong types and impossible values.")
      .def_property_readonly("name", [](const RobotObject& r) { return r.robot.name; })
      .def_property_readonly(
          "model", [](const RobotObject& r) { return r.robot.model; }, "differential_drive or single_axis")
      .def_property_readonly(
          "path", [](const RobotObject& r) { return r.path; }, "as its file was named; empty for one made in Python")
      .def_property_readonly("parameters", &parameters,
                             "one dict for each parameter of theta_L (20): name, unit, physical, physical_unit and "
                             "per_physical (theta_j = per_physical * physical quantity)")
      .def(
          "to_dict", [](const RobotObject& r) { return to_python(robots::to_json(r.robot)); },
          "the keys of the robot file")
      .def(
          "to_yaml", [](const RobotObject& r) { return robots::robot_yaml(r.robot); }, "the text of a robot file")
      .def(
          "save", [](const RobotObject& r, const std::filesystem::path& path) { robots::write_robot(path, r.robot); },
          py::arg("path"), "Writes a robot file, whole or not at all.")
      .def(
          "__eq__",
          [](const RobotObject& a, const RobotObject& b) {
            return robots::to_json(a.robot) == robots::to_json(b.robot);
          },
          py::is_operator())
      .def("__repr__", [](const RobotObject& r) { return "<wheelwright.Robot " + r.robot.name + ">"; });
  m.def("read_robot", &read_file, py::arg("path"),
        "Reads a robot file (YAML).\n\nRaises InputError, naming file, line, key, value and what was expected.");
}

}  // namespace wheelwright::python

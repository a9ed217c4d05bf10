// SPDX-License-Identifier: Apache-2.0
#include "model/differential_drive.hpp"

#include <string>
#include <utility>

#include "core/check.hpp"

namespace wheelwright::model {
namespace {

Parameter viscous(const char* axis, double r) {
  return {.name = std::string("r_viscous_") + axis,
          .unit = "N·s",
          .physical = std::string("viscous_") + axis,
          .physical_unit = "N·s/m",
          .per_physical = r,
          .prior = {0.0, 1e7},
          .excite = std::string(axis) == "linear" ? "drive straight at different speeds"
                                                  : "drive straight at different speeds, heading along x and along y",
          .never_negative = true};
}

}  // namespace

Eigen::Vector2d DifferentialDrive::body_speed(const Eigen::Vector2d& wheel_speed) const {
  return {0.5 * wheel_radius * (wheel_speed[0] + wheel_speed[1]),
          wheel_radius * (wheel_speed[0] - wheel_speed[1]) / track_width};
}

Eigen::Vector2d DifferentialDrive::wheel_speed(const Eigen::Vector2d& body_speed) const {
  const double turn = 0.5 * track_width * body_speed[1];
  return {(body_speed[0] + turn) / wheel_radius, (body_speed[0] - turn) / wheel_radius};
}

Eigen::Vector2d DifferentialDrive::channels(const Eigen::Vector2d& torque) const {
  return {torque[0] + torque[1], lever_arm() * (torque[0] - torque[1])};
}

Model DifferentialDrive::model() const {
  check::positive(wheel_radius, "wheel_radius");
  check::positive(track_width, "track_width");
  const double r = wheel_radius, d = track_width, l = lever_arm();

  Model m;
  m.name = "differential_drive";
  m.on_two_wheels = true;
  m.outputs = {"sum", "difference"};
  m.output_units = {"N·m", "N·m²"};
  m.coordinates = {"v1", "v2"};
  m.joints = {{"phi_r", "omega_r", "tau_r", "current_r", "voltage_r", "command_r"},
              {"phi_l", "omega_l", "tau_l", "current_l", "voltage_l", "command_l"}};
  m.motion = (Eigen::Matrix2d() << r / 2.0, r / 2.0, r / d, -r / d).finished();
  m.input = (Eigen::Matrix2d() << 1.0, 1.0, l, -l).finished();
  m.heading_coordinate = 1;

  const auto add = [&m](Parameter parameter, Term term) {
    term.parameter = m.parameters.size();
    m.parameters.push_back(std::move(parameter));
    m.terms.push_back(term);
  };
  add({.name = "r_mass",
       .unit = "kg·m",
       .physical = "mass",
       .physical_unit = "kg",
       .per_physical = r,
       .prior = {0.0, 1e6},
       .excite = "accelerate and brake",
       .never_negative = true,
       .moved_mass = true},
      {.output = 0, .kind = Term::Kind::acceleration, .coordinate = 0});
  add({.name = "r_yaw_inertia",
       .unit = "kg·m³",
       .physical = "yaw_inertia",
       .physical_unit = "kg·m²",
       .per_physical = r,
       .prior = {0.0, 1e8},
       .excite = "turn with changing yaw rate",
       .never_negative = true},
      {.output = 1, .kind = Term::Kind::acceleration, .coordinate = 1});
  if (anisotropic_friction) {
    add(viscous("x", r), {.output = 0, .kind = Term::Kind::function, .function = TermShape::along_x});
    add(viscous("y", r), {.output = 0, .kind = Term::Kind::function, .function = TermShape::along_y});
    m.heading_used = true;
  } else {
    add(viscous("linear", r), {.output = 0, .kind = Term::Kind::speed, .coordinate = 0});
  }
  add({.name = "r_viscous_yaw",
       .unit = "N·m²·s/rad",
       .physical = "viscous_yaw",
       .physical_unit = "N·m·s/rad",
       .per_physical = r,
       .prior = {0.0, 1e8},
       .excite = "drive in curves",
       .never_negative = true},
      {.output = 1, .kind = Term::Kind::speed, .coordinate = 1});
  if (coulomb) {
    add({.name = "coulomb",
         .unit = "N·m",
         .physical = "coulomb",
         .physical_unit = "N·m",
         .per_physical = 1.0,
         .prior = {0.0, 1e6},
         .excite = "drive in both directions",
         .on_request = true,
         .dry_friction = true,
         .never_negative = true},
        {.output = 0, .kind = Term::Kind::function, .function = TermShape::sum_of_signs});
    m.terms.push_back({.output = 1,
                       .parameter = m.terms.back().parameter,
                       .kind = Term::Kind::function,
                       .scale = l,
                       .function = TermShape::difference_of_signs});
  }
  return m;
}

}  // namespace wheelwright::model

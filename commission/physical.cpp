// SPDX-License-Identifier: Apache-2.0
#include "commission/physical.hpp"

#include <cmath>

#include "core/words.hpp"
#include "identify/least_squares.hpp"

namespace wheelwright::commission {
namespace {

constexpr double kWorthwhile = 0.9;

}  // namespace

ParameterChoice choose_parameters(core::RegressionSource& rows, std::size_t basic, std::size_t log_rows,
                                  const FoldOptions& folds) {
  FoldedSource training(rows, Part::training, log_rows, folds);
  FoldedSource held_out(rows, Part::held_out, log_rows, folds);
  identify::LeastSquares fit(rows.parameters());
  core::for_each_block(training, [&](const RegressionBlock& block) { fit.add(block); });
  std::vector<bool> beyond(rows.parameters(), false);
  for (std::size_t j = basic; j < beyond.size(); ++j) {
    beyond[j] = true;
  }
  const Eigen::VectorXd small = fit.solve(beyond).estimate;
  const Eigen::VectorXd large = fit.solve().estimate;
  double error_small = 0.0, error_large = 0.0, torque = 0.0;
  core::for_each_block(held_out, [&](const RegressionBlock& block) {
    error_small += (block.y - block.Y * small).squaredNorm();
    error_large += (block.y - block.Y * large).squaredNorm();
    torque += block.y.squaredNorm();
  });
  ParameterChoice choice;
  if (torque > 0.0) {
    choice.nrmse_basic = std::sqrt(error_small / torque);
    choice.nrmse_full = std::sqrt(error_large / torque);
    choice.full = choice.nrmse_full < kWorthwhile * choice.nrmse_basic;
  }
  return choice;
}

namespace {

std::string in_effort_unit(const Robot& robot, const std::string& unit) {
  if (robot.effort == model::EffortKind::torque) {
    return unit;
  }
  std::string effort = robot.effort == model::EffortKind::current ? "A" : "V";
  if (unit == "N·m") {
    return effort;
  }
  if (unit == "N·m²") {
    return effort + "·m";
  }
  return {};
}

}  // namespace

std::optional<std::vector<PhysicalScale>> physical_scales(const Robot& robot, const Model& model) {
  const bool torque = robot.effort == model::EffortKind::torque;
  const bool voltage = robot.effort == model::EffortKind::voltage;
  const bool known =
      robot.motor && robot.motor->torque_constant && (!voltage || (robot.motor->resistance && robot.motor->back_emf));
  if (!torque && !known) {
    return std::nullopt;
  }
  std::vector<PhysicalScale> scales;
  for (const model::Parameter& parameter : model.parameters) {
    PhysicalScale scale{1.0 / parameter.per_physical, 0.0};
    if (voltage && parameter.physical.starts_with("viscous")) {
      const model::Motor& motor = *robot.motor;
      const double braking =
          *motor.torque_constant * *motor.back_emf * motor.gear_ratio * motor.gear_ratio / *motor.resistance;
      const double r = robot.wheel_radius;
      const double arm = robot.lever_arm_is_track ? robot.track_width : 0.5 * robot.track_width;
      if (!model::on_two_wheels(robot)) {
        scale.offset = braking;
      } else if (parameter.physical == "viscous_yaw") {
        scale.offset = braking * arm * robot.track_width / (r * r);
      } else {
        scale.offset = 2.0 * braking / (r * r);
      }
    }
    scales.push_back(scale);
  }
  return scales;
}

std::string parameter_unit(const Robot& robot, const model::Parameter& parameter) {
  if (robot.effort == model::EffortKind::torque) {
    return parameter.unit;
  }
  std::string effort = robot.effort == model::EffortKind::current ? "A" : "V";
  std::string unit = parameter.unit;
  if (parameter.name == "r_mass") {
    return effort + "·s²/m";
  }
  if (parameter.name == "r_yaw_inertia") {
    return effort + "·m·s²/rad";
  }
  if (parameter.name == "r_viscous_yaw") {
    return effort + "·m·s/rad";
  }
  if (parameter.name.starts_with("r_viscous")) {
    return effort + "·s/m";
  }
  core::replace_all(unit, "N·m", effort);
  core::replace_all(unit, "N", effort);
  return unit;
}

std::string output_unit(const Robot& robot, const std::string& unit) {
  const std::string known = in_effort_unit(robot, unit);
  return known.empty() ? unit + " (of effort)" : known;
}

}  // namespace wheelwright::commission

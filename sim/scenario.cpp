// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/sim/scenario.hpp>

#include <string>

#include <wheelwright/core/check.hpp>
#include <wheelwright/model/effect_law.hpp>
#include <wheelwright/model/effect_terms.hpp>

namespace wheelwright {
namespace {

void validate_sensors(const Sensors& sensors) {
  check::non_negative(sensors.wheel_speed, "sensors.wheel_speed");
  check::non_negative(sensors.wheel_angle, "sensors.wheel_angle");
  check::non_negative(sensors.effort, "sensors.effort");
  check::non_negative(sensors.position, "sensors.position");
  check::non_negative(sensors.heading, "sensors.heading");
  if (sensors.encoder_counts_per_turn) {
    check::positive(*sensors.encoder_counts_per_turn, "sensors.encoder_counts_per_turn");
  }
  check::that(sensors.angles || sensors.speeds, "sensors", "angles or speeds of the wheels, or both");
}

void validate_gains(const ControllerGains& gains) {
  check::non_negative(gains.along, "controller.along");
  check::non_negative(gains.across, "controller.across");
  check::non_negative(gains.heading, "controller.heading");
  check::non_negative(gains.speed, "controller.speed");
  check::non_negative(gains.integral, "controller.integral");
}

}  // namespace

DifferentialDrive drive_of(const Robot& robot) {
  return {robot.wheel_radius, robot.track_width, robot.lever_arm_is_track, robot.anisotropic_friction};
}

void validate(const Scenario& scenario) {
  check::that(scenario.robot.model == "differential_drive", "robot.model is '" + scenario.robot.model + "'",
              "differential_drive, which is what can be simulated");
  static_cast<void>(make_model(scenario.robot));
  check::that(scenario.robot.effort != EffortKind::voltage, "robot.effort",
              "torque or current: voltages cannot be simulated");
  const bool constant_known = scenario.robot.motor && scenario.robot.motor->torque_constant;
  check::that(scenario.robot.effort == EffortKind::torque || constant_known, "robot.motor.torque_constant",
              "a number > 0 where the effort is a current");
  validate(scenario.parameters);
  validate(nominal_parameters(scenario));
  const double b = effect_value(scenario.robot, "com_lateral", "b");
  check::that(scenario.parameters.mass * b * b < scenario.parameters.yaw_inertia, "effects.com_lateral.b",
              "a centre of mass with m b² below the yaw inertia about the axle");
  validate(scenario.trajectory);
  validate_gains(scenario.controller);
  validate(scenario.faults, drive_of(scenario.robot));
  validate_sensors(scenario.sensors);
  if (scenario.torque_limit) {
    check::positive(*scenario.torque_limit, "torque_limit");
  }
  check::that(scenario.initial_pose.allFinite(), "initial_pose", "finite numbers");
  check::that(scenario.initial_pose_error.allFinite(), "initial_pose_error", "finite numbers");
  check::positive(scenario.duration, "duration");
  check::positive(scenario.rate, "rate");
  check::that(scenario.duration * scenario.rate <= 1e12, "duration", "10¹² samples at most");
  check::that(scenario.time_jitter >= 0.0 && scenario.time_jitter < 0.5, "time_jitter", "a share in [0, 0.5)");
  double last = 0.0;
  for (std::size_t k = 0; k < scenario.gaps.size(); ++k) {
    const Interval& gap = scenario.gaps[k];
    const std::string name = "gaps[" + std::to_string(k) + "]";
    check::that(gap.lower >= last, name, "gaps after 0, in order of time, that do not overlap");
    check::that(gap.upper - gap.lower > 6.0 / scenario.rate, name, "a length of more than 6 sampling periods");
    check::finite(gap.upper, name + ".upper");
    last = gap.upper;
  }
}

DriveParameters nominal_parameters(const Scenario& scenario) {
  DriveParameters nominal = scenario.parameters;
  const auto take = [&scenario](const char* name, double& value) {
    if (const auto found = scenario.robot.nominal.find(name); found != scenario.robot.nominal.end()) {
      value = found->second;
    }
  };
  take("mass", nominal.mass);
  take("yaw_inertia", nominal.yaw_inertia);
  take("viscous_linear", nominal.viscous_x);
  take("viscous_linear", nominal.viscous_y);
  take("viscous_x", nominal.viscous_x);
  take("viscous_y", nominal.viscous_y);
  take("viscous_yaw", nominal.viscous_yaw);
  return nominal;
}

Eigen::VectorXd true_parameters(const Scenario& scenario, const Model& model) {
  const DriveParameters& truth = scenario.parameters;
  const double yaw_convention = drive_of(scenario.robot).lever_arm() / (0.5 * scenario.robot.track_width);
  Eigen::VectorXd theta(static_cast<Eigen::Index>(model.p()));
  for (std::size_t j = 0; j < model.p(); ++j) {
    const Parameter& parameter = model.parameters[j];
    double physical = 0.0;
    if (parameter.physical == "mass") {
      physical = truth.mass;
    } else if (parameter.physical == "yaw_inertia") {
      physical = yaw_convention * truth.yaw_inertia;
    } else if (parameter.physical == "viscous_linear") {
      check::that(truth.viscous_x == truth.viscous_y, "parameters", "isotropic friction for a model of viscous_linear");
      physical = truth.viscous_x;
    } else if (parameter.physical == "viscous_x") {
      physical = truth.viscous_x;
    } else if (parameter.physical == "viscous_y") {
      physical = truth.viscous_y;
    } else if (parameter.physical == "viscous_yaw") {
      physical = yaw_convention * truth.viscous_yaw;
    } else if (const auto of_effect = effect_truth(scenario.robot, parameter.physical, truth.mass)) {
      physical = *of_effect;
    } else {
      throw InvalidArgument("model: a differential drive has no parameter '" + parameter.physical + "'");
    }
    theta[static_cast<Eigen::Index>(j)] = parameter.per_physical * physical;
  }
  return theta;
}

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// What is to be simulated, as plain data.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/model/faults.hpp>
#include <wheelwright/model/robot.hpp>
#include <wheelwright/sim/controller.hpp>
#include <wheelwright/sim/noise.hpp>
#include <wheelwright/sim/trajectory.hpp>

namespace wheelwright {

/// What a row of the log stands for.
enum class Sampling {
  instant,   ///< everything at the time stamp: speeds are samples of the speed
  interval,  ///< a sampling interval, stamped at its middle: speeds are angle differences over it (encoder differences
             ///< where the encoder is quantised), efforts its mean; angles and pose are those of the stamp
};

/// What is logged, and how wrong it is. Bounds are |error| <= bound; 0 means exact.
struct Sensors {
  Sampling sampling = Sampling::instant;
  NoiseShape noise = NoiseShape::uniform;
  double wheel_speed = 0.0;                       ///< bound, rad/s
  double wheel_angle = 0.0;                       ///< bound before quantisation, rad
  double effort = 0.0;                            ///< bound, unit of the effort
  double position = 0.0;                          ///< bound on x and y, m
  double heading = 0.0;                           ///< bound, rad
  std::optional<double> encoder_counts_per_turn;  ///< rounds wheel angles to the nearest count
  bool angles = true;                             ///< columns phi_r, phi_l
  bool speeds = true;                             ///< columns omega_r, omega_l
  bool pose = true;                               ///< columns x, y, theta
  bool commands = true;                           ///< columns command_r, command_l
};

/// A simulated drive of a differential-drive robot.
struct Scenario {
  Robot robot;                 ///< geometry, effort (torque, or current with the motor's constants), hold; `nominal` is
                               ///< what the controller believes, where it is given
  DriveParameters parameters;  ///< the truth, physical (ℓ = D/2)
  Trajectory trajectory;
  ControllerGains controller;
  std::optional<double> torque_limit;                            ///< saturation of each wheel, N·m
  Eigen::Vector3d initial_pose = Eigen::Vector3d::Zero();        ///< of the reference, m, m, rad
  Eigen::Vector3d initial_pose_error = Eigen::Vector3d::Zero();  ///< robot minus reference, m, m, rad
  std::vector<Fault> faults;
  Sensors sensors;
  double duration = 60.0;      ///< s
  double rate = 100.0;         ///< samples and control periods per second, Hz
  double time_jitter = 0.0;    ///< largest shift of a sample as a share of the period, in [0, 0.5)
  std::vector<Interval> gaps;  ///< times [lower, upper) in which nothing is logged, s; longer than 6 periods each
  std::uint64_t seed = 1;
};

/// Throws InvalidArgument, naming the field, unless everything in `scenario` makes sense together.
void validate(const Scenario& scenario);

/// Geometry of the scenario's robot.
[[nodiscard]] DifferentialDrive drive_of(const Robot& robot);

/// What the controller believes: the robot's nominal values where they are given, else the truth.
[[nodiscard]] DriveParameters nominal_parameters(const Scenario& scenario);

/// θ_L of the scenario's truth in the order of `model.parameters`, units of θ_L; in the model's own lever-arm
/// convention (with ℓ = D inertia and friction of yaw come out doubled); those of effects are the mid-points of the robot's. Throws InvalidArgument when the model has a
/// parameter that a differential drive does not, or has one viscous_linear while the truth is anisotropic.
[[nodiscard]] Eigen::VectorXd true_parameters(const Scenario& scenario, const Model& model);

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Scenarios: the drives, robots, faults and sensors that a simulation makes a log of.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/interval.hpp"
#include "model/differential_drive.hpp"
#include "model/faults.hpp"
#include "model/robot.hpp"

namespace wheelwright::sim {

/// Speeds over time, linear between the rows; at rest before the first row and after the last one.
struct SpeedTable {
  std::vector<double> t;               ///< s, increasing
  std::vector<Eigen::Vector2d> speed;  ///< [v1, v2] at these times, m/s, rad/s
};

/// Motion of the reference robot. Speeds start from 0 over one second, and are continuously differentiable; those of a
/// table are as the table says.
struct Trajectory {
  enum class Kind {
    straight,       ///< v1 = speed·(0.6 + 0.4 sin), no turning
    circle,         ///< constant speed and yaw rate
    figure_eight,   ///< constant speed, heading swinging by 2.405 rad (the first zero of J0, so that it closes)
    multi_sine,     ///< both speeds of three sines, reversals included
    spin,           ///< turning on the spot, to and fro
    stops,          ///< drives in curves, and stands still half of the time
    commissioning,  ///< straight, figure eight, multi-sine, spin, and driving in curves, one period each, with stops
    table,          ///< the speeds of `table`
  };
  Kind kind = Kind::commissioning;
  double speed = 0.5;     ///< largest |v1|, m/s
  double yaw_rate = 0.8;  ///< largest |v2|, rad/s; the figure eight's own is 2.405·2π/period
  double period = 10.0;   ///< s
  SpeedTable table = {};  ///< of Kind::table
};

/// Throws InvalidArgument, naming the field, unless speed and yaw rate are >= 0, the period is > 0 and, for
/// Kind::table, the table has two rows or more of finite numbers with increasing times.
void validate(const Trajectory& trajectory);

/// Gains of the tracking controller.
struct ControllerGains {
  double along = 1.0;     ///< of the error along the heading, 1/s
  double across = 4.0;    ///< of the error across it, rad/m² (times v_d sinc θ_e)
  double heading = 2.0;   ///< of the heading error, 1/s
  double speed = 8.0;     ///< of the speed error, 1/s
  double integral = 8.0;  ///< of its integral, 1/s²
};

/// Distribution of the noise inside its bound.
enum class NoiseShape {
  uniform,             ///< on [−bound, bound]
  truncated_gaussian,  ///< standard deviation bound/3 before it is cut at ±bound
  two_point,           ///< −bound or bound, as a coin decides
};

/// Meaning of a row of the log.
enum class Sampling {
  instant,   ///< everything at the time stamp: speeds are samples of the speed
  interval,  ///< a sampling interval, stamped at its middle: speeds are angle differences over it (encoder differences
             ///< where the encoder is quantised), efforts its mean; angles and pose are those of the stamp
};

/// Logged signals and their errors. Bounds are |error| <= bound; 0 means exact.
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
  Robot robot;  ///< geometry, effort (torque, or current with the motor's constants), hold; `nominal` is
                ///< what the controller believes, where it is given
  model::DriveParameters parameters;  ///< the truth, physical (ℓ = D/2)
  Trajectory trajectory;
  ControllerGains controller;
  std::optional<double> torque_limit;                            ///< saturation of each wheel, N·m
  Eigen::Vector3d initial_pose = Eigen::Vector3d::Zero();        ///< of the reference, m, m, rad
  Eigen::Vector3d initial_pose_error = Eigen::Vector3d::Zero();  ///< robot minus reference, m, m, rad
  std::vector<model::Fault> faults;
  Sensors sensors;
  double duration = 60.0;      ///< s
  double rate = 100.0;         ///< samples and control periods per second, Hz
  double time_jitter = 0.0;    ///< largest shift of a sample as a share of the period, in [0, 0.5)
  std::vector<Interval> gaps;  ///< times [lower, upper) in which nothing is logged, s; longer than 6 periods each
  std::uint64_t seed = 1;
};

/// Throws InvalidArgument, naming the field, unless everything in `scenario` makes sense together.
void validate(const Scenario& scenario);

}  // namespace wheelwright::sim

namespace wheelwright {
using sim::Scenario;
}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Reference trajectories q_d(t) of Assumption 2: a reference robot that rolls without slipping.
#pragma once

#include <string_view>
#include <vector>

#include <Eigen/Core>

namespace wheelwright {

/// Speeds over time, linear between the rows; at rest before the first row and after the last one.
struct SpeedTable {
  std::vector<double> t;               ///< s, increasing
  std::vector<Eigen::Vector2d> speed;  ///< [v1, v2] at these times, m/s, rad/s
};

/// What the reference robot does. Speeds start from 0 over one second, and are continuously differentiable; those of a
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

/// Name of a kind as scenario files write it, e.g. "figure_eight".
[[nodiscard]] std::string_view to_string(Trajectory::Kind kind);

/// Throws InvalidArgument, naming the field, unless speed and yaw rate are >= 0, the period is > 0 and, for
/// Kind::table, the table has two rows or more of finite numbers with increasing times.
void validate(const Trajectory& trajectory);

/// Reference speeds at one instant.
struct ReferenceSpeed {
  Eigen::Vector2d speed = Eigen::Vector2d::Zero();         ///< v_d, m/s, rad/s
  Eigen::Vector2d acceleration = Eigen::Vector2d::Zero();  ///< v̇_d, m/s², rad/s²
};

/// v_d and v̇_d at time `t` (s, >= 0).
[[nodiscard]] ReferenceSpeed reference_speed(const Trajectory& trajectory, double t);

/// The pose [x, y, θ] (m, m, rad) of the reference robot one step `h` (s) after `pose` at time `t`: the arc of the
/// twist at the middle of the step, exact for constant speeds, else with an error of O(h³) a step.
[[nodiscard]] Eigen::Vector3d advance_reference(const Trajectory& trajectory, const Eigen::Vector3d& pose, double t,
                                                double h);

}  // namespace wheelwright

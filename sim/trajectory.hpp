// SPDX-License-Identifier: Apache-2.0
/// \file
/// Reference trajectories of the paper and the controller that follows them.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/model/differential_drive.hpp>
#include <wheelwright/model/faults.hpp>

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

/// Gains of the tracking controller.
struct ControllerGains {
  double along = 1.0;     ///< of the error along the heading, 1/s
  double across = 4.0;    ///< of the error across it, rad/m² (times v_d sinc θ_e)
  double heading = 2.0;   ///< of the heading error, 1/s
  double speed = 8.0;     ///< of the speed error, 1/s
  double integral = 8.0;  ///< of its integral, 1/s²
};

/// Tracks a reference pose. The kinematic law is Samson's (1993, nonlinear form of Kanayama et al. 1990), which also
/// holds in reverse:
///   v_c = v_d cos θ_e + k_x x_e,   ω_c = ω_d + k_y v_d (sin θ_e / θ_e) y_e + k_θ θ_e
/// and the torque follows from the nominal model,
///   [1 1; ℓ −ℓ]τ = r (M̂ (v̇_d + k_p e + k_i ∫e) + F̂ v_c),  e = v_c − v.
/// With M̂, F̂ of the robot and no fault the tracking error tends to 0 as the period does.
class TrackingController {
 public:
  /// `nominal` is what the controller believes of the robot; `torque_limit` (N·m) saturates each wheel where given.
  TrackingController(const DifferentialDrive& drive, const model::DriveParameters& nominal,
                     const ControllerGains& gains, std::optional<double> torque_limit);

  /// What the controller asks for.
  struct Command {
    Eigen::Vector2d speed = Eigen::Vector2d::Zero();   ///< [v_c, ω_c], m/s, rad/s
    Eigen::Vector2d torque = Eigen::Vector2d::Zero();  ///< [τ_R, τ_L], N·m
  };

  /// The command for measured `pose` [x, y, θ] and speeds `v`, to be held for `h` seconds.
  [[nodiscard]] Command step(const Eigen::Vector3d& reference_pose, const ReferenceSpeed& reference,
                             const Eigen::Vector3d& pose, const Eigen::Vector2d& v, double h);

  /// Forgets the integral.
  void reset() { integral_.setZero(); }

 private:
  DifferentialDrive drive_;
  model::DriveParameters nominal_;
  ControllerGains gains_;
  std::optional<double> torque_limit_;
  Eigen::Vector2d integral_ = Eigen::Vector2d::Zero();
};

}  // namespace wheelwright::sim

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The control that Assumption 2 asks for: kinematic tracking, then inverse dynamics with what is nominally known.
#pragma once

#include <optional>

#include <Eigen/Core>

#include <wheelwright/model/differential_drive.hpp>
#include <wheelwright/model/faults.hpp>
#include <wheelwright/sim/trajectory.hpp>

namespace wheelwright {

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
  TrackingController(const DifferentialDrive& drive, const DriveParameters& nominal, const ControllerGains& gains,
                     std::optional<double> torque_limit);

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
  DriveParameters nominal_;
  ControllerGains gains_;
  std::optional<double> torque_limit_;
  Eigen::Vector2d integral_ = Eigen::Vector2d::Zero();
};

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// What the effects of a robot add to the forces on a simulated body.
#pragma once

#include <Eigen/Core>

#include <wheelwright/model/differential_drive.hpp>
#include <wheelwright/model/effect_geometry.hpp>
#include <wheelwright/model/faults.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// The numbers of a robot's effects that act between the wheel torques and the body: those of the terms
/// (effect_terms.hpp, with the same signs), and load_friction, friction_drift, wheel_out_of_round and longitudinal_slip.
struct DriveEffects {
  /// None.
  DriveEffects() = default;
  /// Those of `robot` (mid-points of intervals).
  explicit DriveEffects(const Robot& robot);

  bool forces = false;                                  ///< whether there is anything besides geometry
  Eigen::Vector2d radius = Eigen::Vector2d::Zero();     ///< what the wheels' radii have beyond the nominal one, m
  double track = 0.0;                                   ///< what the track width has beyond the nominal one, m
  Eigen::Vector2d coulomb = Eigen::Vector2d::Zero();    ///< N·m
  Eigen::Vector2d bias = Eigen::Vector2d::Zero();       ///< N·m
  Eigen::Vector2d round_cos = Eigen::Vector2d::Zero();  ///< of cos φ, N·m
  Eigen::Vector2d round_sin = Eigen::Vector2d::Zero();  ///< of sin φ, N·m
  double stribeck = 0.0, stribeck_speed = 1.0;          ///< N·m, rad/s
  double viscous = 0.0;                                 ///< of viscous_asymmetric, N·m·s/rad
  double drag = 0.0, drag_yaw = 0.0;                    ///< N·s²/m, N·m²·s²/rad²
  double com_longitudinal = 0.0, com_lateral = 0.0;     ///< m
  Eigen::Vector2d gravity = Eigen::Vector2d::Zero();    ///< [g_x, g_y], m/s²
  double caster = 0.0, caster_arm = 1.0;                ///< N·m, m
  double scrub = 0.0;                                   ///< N·m²
  double load = 0.0;                                    ///< –
  double drift = 0.0, drift_time = 1.0;                 ///< –, s
  double stiffness = 0.0;                               ///< N; 0: no slip
};

/// Where dry friction goes over from one sign to the other: sgn x is x/x0 for |x| < x0. Dry friction that would stop a
/// wheel within a step makes the integration stiff; x0 = 2·step·(slope of the speed per unit of friction) bounds its
/// eigenvalue by ½ per step and source, inside the region in which Runge-Kutta is stable. A robot that stands creeps at
/// x0·τ/c at most (about 10⁻³ rad/s at the wheels) instead of sticking, and a reversal is passed in about a millisecond.
struct DryThreshold {
  double wheel = 0.0;   ///< rad/s
  double yaw = 0.0;     ///< rad/s
  double caster = 0.0;  ///< m/s
};
[[nodiscard]] DryThreshold dry_threshold(const DriveEffects& effects, const DifferentialDrive& drive,
                                         const DriveParameters& parameters, double step);

/// What is lost on the way from the wheel torques to the body.
struct EffectLoad {
  Eigen::Vector2d torque = Eigen::Vector2d::Zero();  ///< at the wheels, N·m
  double force = 0.0;                                ///< along the heading, N
  double moment = 0.0;                               ///< about the vertical, N·m
};

/// The state that effects look at.
struct EffectState {
  double t = 0.0;                                         ///< s
  double speed = 0.0, yaw_rate = 0.0, heading = 0.0;      ///< of the body, m/s, rad/s, rad
  Eigen::Vector2d wheel_speed = Eigen::Vector2d::Zero();  ///< rad/s
  Eigen::Vector2d wheel_angle = Eigen::Vector2d::Zero();  ///< rad
  Eigen::Vector2d torque = Eigen::Vector2d::Zero();       ///< N·m
};

/// The load at one instant; forces of inertia (com_lateral) apart.
[[nodiscard]] EffectLoad effect_load(const DriveEffects& effects, const DifferentialDrive& drive,
                                     const DriveParameters& parameters, const DryThreshold& threshold,
                                     const EffectState& state);

/// Slip of the wheels as a share of their speeds, force/stiffness, at most a fifth, for the wheel forces `force` (N).
[[nodiscard]] Eigen::Vector2d slip_share(const DriveEffects& effects, const Eigen::Vector2d& force,
                                         const Eigen::Vector2d& rim_speed);

}  // namespace wheelwright

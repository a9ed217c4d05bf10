// SPDX-License-Identifier: Apache-2.0
/// \file
/// Every fault of Dixon, Walker and Dawson (2001) as data, and what it does to the kinematics, δ(t) of (6), and to the
/// torque equation, ζ(t) of (16).
#pragma once

#include <limits>
#include <span>
#include <string_view>

#include <Eigen/Core>

#include <wheelwright/model/differential_drive.hpp>

namespace wheelwright::model {

/// Physical parameters of a differential-drive robot; friction acts along the world axes, F_d = diag(f1, f2, f3) of
/// (13).
struct DriveParameters {
  double mass = 0.0;         ///< m, kg
  double yaw_inertia = 0.0;  ///< I, kg·m² (in the lever-arm convention of the DifferentialDrive it is used with)
  double viscous_x = 0.0;    ///< f1, N·s/m
  double viscous_y = 0.0;    ///< f2, N·s/m; equal to f1 where friction is isotropic
  double viscous_yaw = 0.0;  ///< f3, N·m·s/rad
};

/// Throws InvalidArgument, naming the field, unless mass and yaw inertia are > 0 and the friction is >= 0.
void validate(const DriveParameters& parameters);

/// Time profile of a fault: 0 before `onset`, 1 from `onset` + `rise_time` on, and the same way back from `end`. (8)
/// asks for a differentiable fault: `smooth` is, `ramp` is but for its two corners, `step` is not (its rate is 0
/// wherever it exists).
struct TimeProfile {
  /// The way from 0 to 1 over the rise time.
  enum class Shape {
    step,    ///< at once; the rise time is not used
    ramp,    ///< linear
    smooth,  ///< half a cosine, (1 − cos πs)/2
  };
  Shape shape = Shape::step;
  double onset = 0.0;                                    ///< T of (7), s
  double rise_time = 0.0;                                ///< s, > 0 for ramp and smooth
  double end = std::numeric_limits<double>::infinity();  ///< s, >= onset + rise time

  /// Share of the magnitude at time `t` (s), in [0, 1].
  [[nodiscard]] double value(double t) const;
  /// Its time derivative, 1/s (at a corner, that of the later side).
  [[nodiscard]] double rate(double t) const;
};

/// One fault.
struct Fault {
  /// What changes.
  enum class Kind {
    wheel_radius,        ///< δ1 of (1): both wheel radii, m
    wheel_radius_right,  ///< δ1R of Remark 1: the right wheel's radius, m
    wheel_radius_left,   ///< δ1L of Remark 1: the left wheel's radius, m
    slip_x,              ///< δ2 of (1): slip or skid along the world x axis, m/s
    slip_y,              ///< δ3 of (1): along the world y axis, m/s
    slip_yaw,            ///< δ4 of (1): about the vertical, rad/s
    matched,             ///< ρ_M of (10): along the heading, m/s
    unmatched,           ///< ρ_U of (11): across the heading, to the right, m/s
  };
  Kind kind = Kind::wheel_radius;
  double magnitude = 0.0;  ///< at full size, unit of the kind
  TimeProfile profile;
};

/// Name of a kind as scenario files write it, e.g. "wheel_radius_right".
[[nodiscard]] std::string_view to_string(Fault::Kind kind);

/// Throws InvalidArgument, naming the fault, unless magnitudes and times are finite (`end` may be infinite), profiles
/// are as TimeProfile says, and the radii stay positive at all times whatever falls together, r + δ1 > 0 (12).
void validate(std::span<const Fault> faults, const DifferentialDrive& drive);

/// The sum of all faults at one instant, and its rate.
struct FaultState {
  Eigen::Vector2d radius = Eigen::Vector2d::Zero();       ///< [δ1R, δ1L], m
  Eigen::Vector2d radius_rate = Eigen::Vector2d::Zero();  ///< m/s
  Eigen::Vector3d slip = Eigen::Vector3d::Zero();         ///< [δ2, δ3, δ4], m/s, m/s, rad/s
  Eigen::Vector3d slip_rate = Eigen::Vector3d::Zero();    ///< m/s², m/s², rad/s²
  double matched = 0.0;                                   ///< ρ_M, m/s
  double matched_rate = 0.0;                              ///< m/s²
  double unmatched = 0.0;                                 ///< ρ_U, m/s
  double unmatched_rate = 0.0;                            ///< m/s²
};

/// All of `faults` at time `t` (s).
[[nodiscard]] FaultState fault_state(std::span<const Fault> faults, double t);

}  // namespace wheelwright::model

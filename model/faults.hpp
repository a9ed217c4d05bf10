// SPDX-License-Identifier: Apache-2.0
/// \file
/// Faults of a simulation: which sets in when, and what all of them together do to wheels and body, as Dixon, Walker
/// and Dawson (2001) have them.
#pragma once

#include <limits>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "model/differential_drive.hpp"
#include "model/fault_type.hpp"

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

/// Time profile of a simulated fault: that of its shape from `onset` on, and the same way back from `end`.
struct TimeProfile {
  using Shape = FaultProfile::Kind;
  Shape shape = Shape::step;                             ///< step, ramp or smooth
  double onset = 0.0;                                    ///< T of (7), s
  double rise_time = 0.0;                                ///< s, > 0 for ramp and smooth
  double end = std::numeric_limits<double>::infinity();  ///< s, >= onset + rise time

  /// Share of the magnitude at time `t` (s), in [0, 1].
  [[nodiscard]] double value(double t) const;
  /// Its time derivative, 1/s (at a corner, that of the later side; 0 for a step).
  [[nodiscard]] double rate(double t) const;
};

/// One simulated fault.
struct Fault {
  using Kind = FaultKind;
  Kind kind = Kind::wheel_radius;  ///< one of simulated_faults()
  double magnitude = 0.0;          ///< at full size, m for a wheel radius, else unit of the kind
  TimeProfile profile;
};

/// The kinds that a simulator has.
[[nodiscard]] std::vector<FaultKind> simulated_faults();

/// Throws InvalidArgument, naming the fault, unless kinds are simulated, magnitudes and times are finite (`end` may be
/// infinite), profiles are as TimeProfile says, and the radii stay positive at all times whatever falls together,
/// r + δ1 > 0 (12).
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

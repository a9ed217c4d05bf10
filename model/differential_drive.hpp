// SPDX-License-Identifier: Apache-2.0
/// \file
/// The two-wheel robot of Dixon, Walker and Dawson (2001), sections II and III.
#pragma once

#include <Eigen/Core>

#include "model/model.hpp"

namespace wheelwright::model {

/// Geometry of a differential-drive robot and the conventions of its model.
struct DifferentialDrive {
  double wheel_radius = 0.0;          ///< r, m
  double track_width = 0.0;           ///< D, m
  bool lever_arm_is_track = false;    ///< ℓ = D as the paper writes (14), instead of the physical D/2
  bool anisotropic_friction = false;  ///< friction f1 ≠ f2 along the world axes: five parameters
  bool coulomb = false;               ///< with dry friction at both wheels, not in the paper: one parameter more

  /// The yaw lever arm ℓ, m.
  [[nodiscard]] double lever_arm() const { return lever_arm_is_track ? track_width : 0.5 * track_width; }

  /// [v1, v2] (m/s, rad/s) of wheel speeds [ω_R, ω_L] (rad/s), (5).
  [[nodiscard]] Eigen::Vector2d body_speed(const Eigen::Vector2d& wheel_speed) const;

  /// [ω_R, ω_L] (rad/s) of [v1, v2], the inverse of (5).
  [[nodiscard]] Eigen::Vector2d wheel_speed(const Eigen::Vector2d& body_speed) const;

  /// The left side of (15), [1 1; ℓ −ℓ] τ (N·m, N·m²), for wheel torques τ = [τ_R, τ_L] (N·m).
  [[nodiscard]] Eigen::Vector2d channels(const Eigen::Vector2d& torque) const;

  /// The model with θ_L = r·[m, I, f1, f3] (20); with anisotropic friction r·[m, I, f1, f2, f3], where the friction of
  /// the sum channel is f1 cos²θ + f2 sin²θ. With dry friction of torque c at each wheel, θ_L ends in c, and Y in
  /// [sgn ω_R + sgn ω_L; ℓ(sgn ω_R − sgn ω_L)]. Throws InvalidArgument unless r and D are > 0.
  [[nodiscard]] Model model() const;
};

}  // namespace wheelwright::model

namespace wheelwright {
using model::DifferentialDrive;
}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// What the paper's equations say of a fault: the oracle of the plant and of the rows of faults.
#pragma once

#include <cmath>

#include <Eigen/Core>

#include "model/differential_drive.hpp"
#include "model/faults.hpp"

namespace wheelwright {

/// The robot at one instant, as its encoders see it with the nominal radius.
struct DriveMotion {
  double heading = 0.0;                                    ///< θ, rad
  Eigen::Vector2d speed = Eigen::Vector2d::Zero();         ///< v of (5), m/s, rad/s
  Eigen::Vector2d acceleration = Eigen::Vector2d::Zero();  ///< v̇, m/s², rad/s²
};

/// S(q) of (3), 3 × 2, for the heading θ (rad).
inline Eigen::Matrix<double, 3, 2> kinematic_matrix(double heading) {
  return (Eigen::Matrix<double, 3, 2>() << std::cos(heading), 0.0, std::sin(heading), 0.0, 0.0, 1.0).finished();
}

// v⁺ = K v is what unequal or changed radii add to the body speed: K = G diag(δ1R, δ1L) (r G)⁻¹, G = [½ ½; 1/D −1/D].
inline Eigen::Matrix2d radius_gain(const DifferentialDrive& drive, const Eigen::Vector2d& radius) {
  const double r = drive.wheel_radius, d = drive.track_width;
  const double mean = 0.5 * (radius[0] + radius[1]) / r, half_difference = 0.5 * (radius[0] - radius[1]) / r;
  return (Eigen::Matrix2d() << mean, half_difference * d / 2.0, half_difference * 2.0 / d, mean).finished();
}

// [1 1; ℓ −ℓ] diag(r+δ1R, r+δ1L) [1 1; ℓ −ℓ]⁻¹
inline Eigen::Matrix2d torque_gain(const DifferentialDrive& drive, const Eigen::Vector2d& radius) {
  const double l = drive.lever_arm();
  const double mean = drive.wheel_radius + 0.5 * (radius[0] + radius[1]);
  const double half_difference = 0.5 * (radius[0] - radius[1]);
  return (Eigen::Matrix2d() << mean, half_difference / l, half_difference * l, mean).finished();
}

/// δ(t) of (6) in the world frame, m/s, m/s, rad/s: what q̇ = S v + δ has beyond pure rolling; ρ_M (10), ρ_U (11) and
/// unequal radii (Remark 1) included.
inline Eigen::Vector3d delta(const DifferentialDrive& drive, const model::FaultState& fault,
                             const DriveMotion& motion) {
  const double c = std::cos(motion.heading), s = std::sin(motion.heading);
  return fault.slip + kinematic_matrix(motion.heading) * (radius_gain(drive, fault.radius) * motion.speed) +
         fault.matched * Eigen::Vector3d(c, s, 0.0) + fault.unmatched * Eigen::Vector3d(s, -c, 0.0);
}

/// δ̇(t), m/s², m/s², rad/s², along the motion (θ̇ = v2 + δ_θ).
inline Eigen::Vector3d delta_rate(const DifferentialDrive& drive, const model::FaultState& fault,
                                  const DriveMotion& motion) {
  const double c = std::cos(motion.heading), s = std::sin(motion.heading);
  const Eigen::Vector2d gained = radius_gain(drive, fault.radius) * motion.speed;
  const Eigen::Vector2d gained_rate =
      radius_gain(drive, fault.radius) * motion.acceleration + radius_gain(drive, fault.radius_rate) * motion.speed;
  const double yaw_rate = motion.speed[1] + gained[1] + fault.slip[2];
  const Eigen::Vector3d along(c, s, 0.0), right(s, -c, 0.0);
  return fault.slip_rate + kinematic_matrix(motion.heading) * gained_rate + fault.matched_rate * along +
         fault.unmatched_rate * right + yaw_rate * (fault.unmatched * along - (fault.matched + gained[0]) * right);
}

/// ζ(t) of (16), N·m, N·m²: [1 1; ℓ −ℓ]τ − r(M̄ v̇ + F̄ v). For unequal radii (Remark 1) the wheel forces are
/// τ_R/(r+δ1R) and τ_L/(r+δ1L), and
///   ζ = A (M̄ v̇ + F̄ v + SᵀM δ̇ + SᵀF_d δ) − r (M̄ v̇ + F̄ v),  A = [1 1; ℓ −ℓ] diag(r+δ1R, r+δ1L) [1 1; ℓ −ℓ]⁻¹,
/// which is (16) when they are equal.
inline Eigen::Vector2d zeta(const DifferentialDrive& drive, const model::DriveParameters& p,
                            const model::FaultState& fault, const DriveMotion& motion) {
  const Eigen::Matrix<double, 3, 2> s = kinematic_matrix(motion.heading);
  const Eigen::Vector3d mass(p.mass, p.mass, p.yaw_inertia), friction(p.viscous_x, p.viscous_y, p.viscous_yaw);
  const Eigen::Matrix2d mbar = s.transpose() * mass.asDiagonal() * s, fbar = s.transpose() * friction.asDiagonal() * s;
  const Eigen::Vector2d healthy = mbar * motion.acceleration + fbar * motion.speed;
  const Eigen::Vector2d added = s.transpose() * (mass.cwiseProduct(delta_rate(drive, fault, motion)) +
                                                 friction.cwiseProduct(delta(drive, fault, motion)));
  return torque_gain(drive, fault.radius) * (healthy + added) - drive.wheel_radius * healthy;
}

}  // namespace wheelwright

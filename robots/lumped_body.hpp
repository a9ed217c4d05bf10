// SPDX-License-Identifier: Apache-2.0
/// \file
/// The mass and the yaw inertia of the model, from the inertials of a robot description.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/robots/robot_tree.hpp>
#include <wheelwright/robots/wheel_geometry.hpp>

namespace wheelwright {

/// A robot as the model sees it: one body that carries the turning wheels.
struct LumpedBody {
  double mass = 0.0;         ///< Σ m_k over all links, kg
  double yaw_inertia = 0.0;  ///< about the vertical through the middle of the axle, wheels not turning, kg·m²
  double spin = 0.0;         ///< J_R + J_L of wheels and what is fixed to them about their axle, kg·m²
  double ahead = 0.0;        ///< a: of the centre of mass before the middle of the axle, m
  double left = 0.0;         ///< b: to its left, m
  std::size_t links = 0;     ///< with a mass
  std::vector<std::string> massless;  ///< links without one: frames, and those that the caller said to be massless
  std::vector<std::string> moving;    ///< joints besides the wheels that are not fixed, taken at their zero position

  /// m = Σ m_k + (J_R + J_L)/r², kg: what multiplies v̇1 in the torque equation.
  [[nodiscard]] double lumped_mass(double wheel_radius) const { return mass + spin / (wheel_radius * wheel_radius); }
  /// I = I_zz + (J_R + J_L) D²/(4r²), kg·m²: what multiplies v̇2.
  [[nodiscard]] double lumped_yaw_inertia(double wheel_radius, double track_width) const {
    const double share = 0.5 * track_width / wheel_radius;
    return yaw_inertia + spin * share * share;
  }
};

/// Sums the inertials of `tree`. With the middle of the axle P, the vertical z, and for link k the mass m_k, the centre of mass
/// at d_k from P, and the tensor J_k about it, in the robot's axes,
///
///     I_zz = Σ_k zᵀ J_k z + m_k |z × d_k|²
///
/// where the links of a wheel (turning_links) count with their mean over a turn: (tr J_k − uᵀ J_k u)/2 + m_k (s_k² + ρ_k²/2),
/// with the axle's direction u, s_k along it from P and ρ_k off it. The kinetic energy of body and wheels, rolling with
/// ω_R,L = (v1 ± v2 D/2)/r,
///
///     T = ½ m_Σ v1² + ½ I_zz v2² + ½ J_R ω_R² + ½ J_L ω_L²,      J = Σ uᵀ J_k u + m_k ρ_k²
///
/// makes the wheels' spin part of M̄ = diag(m, I) of the torque equation: m = m_Σ + (J_R + J_L)/r² and
/// I = I_zz + (J_R + J_L) D²/(4r²), in the ratio 1 : (D/2)² that catalogue and identification call `armature`. So the nominal
/// values are those that a log of this robot identifies, with the lever arm D/2. What a gear and rotor add is in no such file.
///
/// A link without an inertial has no mass where it has no shape either (a frame), or is one of `massless`. Throws InputError for
/// any other, naming file, line and link; for a name in `massless` that is no link or has a mass; where nothing has a mass.
[[nodiscard]] LumpedBody lumped_body(const RobotTree& tree, const WheelJoints& wheels, const Axle& axle,
                                     const std::vector<std::string>& massless);

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Wheel joints, wheel radius, track width, mass and yaw inertia of a differential drive, from a robot description.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "formats/robots/robot_description.hpp"

namespace wheelwright::robots {

/// The joints of the driven wheels, and why these.
struct WheelJoints {
  TreeJoint right;
  TreeJoint left;
  std::string reason;  ///< "named by --left and --right", "the only continuous joints ...", "robot.urdf:80: ..."
  std::vector<TreeJoint> others{};  ///< further wheels of robots that skid: each side turns as one
};

/// Names of the wheels' joints from outside the description, and who gave them ("--left and --right", "robot.urdf:9:
/// ..."); empty where nobody did.
struct NamedWheels {
  std::vector<std::string> left, right;
  std::string by;
};

/// The driven wheels of `tree`: those named; else the continuous joints with a level axis across the robot (within 2°
/// of y) whose name, or whose link's name, does not say caster; where these are more than two, those that say wheel.
/// Left is the one with the larger y. As many wheels on each side are a robot that skids: the first of each side are
/// `right` and `left`. Throws InputError where this leaves other than as many wheels on each side, listing the
/// candidates and the options to give; where names and sides contradict each other; for a name that is no such joint
/// (with the nearest that is).
[[nodiscard]] WheelJoints driven_wheels(const RobotTree& tree, const NamedWheels& named);

/// The axle of a differential drive, in the robot's frame.
struct Axle {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< of the wheels' centres, m
  Eigen::Vector3d left = Eigen::Vector3d::UnitY();   ///< unit, from the right wheel to the left one
  Eigen::Vector3d ahead = Eigen::Vector3d::UnitX();  ///< unit, left × up
  Eigen::Vector3d up = Eigen::Vector3d::UnitZ();     ///< unit
  double track_width = 0.0;                          ///< D, m
  std::string origin;                                ///< of the track width
  std::vector<std::string> remarks;
};

/// The radius of the wheels; nothing where no round shape gives it.
struct WheelRadius {
  std::optional<double> value;  ///< m
  std::string origin;           ///< where it came from; without a value, why there is none and what to give
};

/// Names of the links that turn with the child of `joint`: the child, and what is fixed to it.
[[nodiscard]] std::vector<std::string> turning_links(const RobotTree& tree, const TreeJoint& joint);

/// The radius of the larger cylinder (axis along the joint's within 2°) or sphere of a wheel, taken from its collision
/// shapes, from the visual ones where there is no collision. Throws InputError where a wheel's shape stands off its
/// axis by more than a hundredth of the radius, or the two wheels differ by more than 10⁻⁵ of the radius. A wheel whose
/// shape is a mesh, a box or missing has no radius, which is told by `origin`.
[[nodiscard]] WheelRadius wheel_radius(const RobotTree& tree, const WheelJoints& wheels);

/// The axle through the centres of the wheels: D = uᵀ(c_L − c_R) with the wheels' common axis u. The centre of a wheel
/// is that of its round collision shape (visual without one), projected on the joint's axis; without one the joint's
/// origin. Throws InputError unless the axes are parallel to each other and to the line between the centres within 2°,
/// and level within 2°. Where there are further wheels, the middle is that of all, along the way ahead.
[[nodiscard]] Axle axle(const RobotTree& tree, const WheelJoints& wheels);

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

/// Sums the inertials of `tree`. With the middle of the axle P, the vertical z, and for link k the mass m_k, the centre
/// of mass at d_k from P, and the tensor J_k about it, in the robot's axes,
///
///     I_zz = Σ_k zᵀ J_k z + m_k |z × d_k|²
///
/// where the links of a wheel (turning_links) count with their mean over a turn: (tr J_k − uᵀ J_k u)/2 + m_k (s_k² +
/// ρ_k²/2), with the axle's direction u, s_k along it from P and ρ_k off it. The kinetic energy of body and wheels,
/// rolling with ω_R,L = (v1 ± v2 D/2)/r,
///
///     T = ½ m_Σ v1² + ½ I_zz v2² + ½ J_R ω_R² + ½ J_L ω_L²,      J = Σ uᵀ J_k u + m_k ρ_k²
///
/// makes the wheels' spin part of M̄ = diag(m, I) of the torque equation: m = m_Σ + (J_R + J_L)/r² and
/// I = I_zz + (J_R + J_L) D²/(4r²), in the ratio 1 : (D/2)² that catalogue and identification call `armature`. So the
/// nominal values are those that a log of this robot identifies, with the lever arm D/2. What a gear and rotor add is
/// in no such file.
///
/// A link without an inertial has no mass where it has no shape either (a frame), or is one of `massless`, which "all"
/// makes all of them. Throws InputError for others, naming file, line and all of these links; for a name in `massless`
/// that is no link or has a mass; where nothing has a mass.
[[nodiscard]] LumpedBody lumped_body(const RobotTree& tree, const WheelJoints& wheels, const Axle& axle,
                                     const std::vector<std::string>& massless);

}  // namespace wheelwright::robots

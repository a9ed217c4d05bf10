// SPDX-License-Identifier: Apache-2.0
/// \file
/// Effects that are terms of Y: each adds entries to θ_L that a log then bounds, as it does mass and friction.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/model/model.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// Appends the parameters and terms of the robot's effects to `model`, which has the robot's geometry. With ℓ the model's
/// lever arm, k = ℓ/(D/2), and [δs; δd] the additional effort of (15) per unit of the entry of θ_L; ±ℓ stands for the same at
/// both wheels with the signs of the input matrix:
///   coulomb_asymmetric   sgn ω_R (c_R), sgn ω_L (c_L), at the wheel
///   stribeck             e^{−(ω/ω_s)²} sgn ω at both wheels, ω_s fixed
///   viscous_asymmetric   v2 D/(2r) ; ℓ v1/r
///   quadratic_drag       v1|v1| ; 0 (c) and 0 ; k v2|v2| (c2)
///   com_longitudinal     −v2² ; k v1 v2, θ = r·m·a
///   com_lateral          −v̇2 ; −k v̇1, θ = r·m·b
///   torque_bias          1 at the right (b_R), the left wheel (b_L)
///   slope                cos θ ; 0 (θ = r·m·g_x) and sin θ ; 0 (θ = r·m·g_y)
///   caster_drag          v1/V ; k p² v2/V, V² = v1² + p² v2², p fixed
///   lateral_scrub        0 ; k sgn v2
/// and for a single axis stribeck and quadratic_drag of its one speed. `coulomb` is the model's own parameter, and
/// `torque_bias` of a single axis its `offset`. A parameter that the robot file does not name has no entry.
/// Where a sign is in doubt, by the error of the speed, the term is any number in [−1, 1].
void add_effect_terms(Model& model, const Robot& robot);

/// Adds dry friction of the parameter `parameter` at every joint: sgn ω_j times the column of the input matrix.
void add_dry_friction(Model& model, std::size_t parameter);

/// Whether the model parameter with the physical name `physical` is one of the robot's effects, and what the file says of
/// the physical quantity: its interval; [v/3, 3v] for a single value v; for com_* and slope times the mass, which is that
/// of the robot's prior, else [m/3, 3m] of the nominal m, else anything up to 10⁶ kg.
[[nodiscard]] std::optional<Interval> effect_prior(const Robot& robot, const std::string& physical);

/// The physical quantity that a simulator with the mass `mass` (kg) takes for the same parameter; nothing where it is of
/// no effect.
[[nodiscard]] std::optional<double> effect_truth(const Robot& robot, const std::string& physical, double mass);

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The catalogue of unmodelled effects and parametric causes.
#pragma once

#include <vector>

#include <wheelwright/gap/effect.hpp>

namespace wheelwright {

/// All effects and parametric causes for a robot on two driven wheels. Coefficients are of effect_catalogue's units: N·m
/// at the wheel, m, rad, s, kg, relative changes; with current or voltage as effort, A or V stand for N·m.
///
/// Add to the vector, or take from it, as you like: nothing else knows what is in it.
[[nodiscard]] std::vector<Effect> effect_catalogue();

/// The same for the robot `model`: those with one joint have fewer effects, and one coefficient where wheels have two.
[[nodiscard]] std::vector<Effect> effect_catalogue(const Model& model);

/// Dry, viscous, load-dependent and drifting friction, drag, scrub and casters.
[[nodiscard]] std::vector<Effect> friction_effects(std::size_t joints = 2);
/// Masses out of place, slopes, wheels out of round, wheels of other radius, tracks of other width, slip, payload.
[[nodiscard]] std::vector<Effect> geometry_effects(std::size_t joints = 2);
/// Gains, biases, lags, delays, clocks, dead zones, saturation, backlash, batteries.
[[nodiscard]] std::vector<Effect> actuator_effects(std::size_t joints = 2);

}  // namespace wheelwright

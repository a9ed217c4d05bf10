// SPDX-License-Identifier: Apache-2.0
/// \file
/// Effects that are geometry: what turns wheel angles into motion and wheel torques into forces.
#pragma once

#include <Eigen/Core>

#include <wheelwright/model/model.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// The wheels as the effects of a robot leave them.
struct DriveGeometry {
  Eigen::Vector2d radius = Eigen::Vector2d::Zero();         ///< [r_R, r_L], m
  double track_width = 0.0;                                 ///< D, m
  Eigen::Vector2d encoder_scale = Eigen::Vector2d::Ones();  ///< what an encoder shows per unit of what is
};

/// The geometry of a differential drive: `wheel_radius_asymmetric` r(1 ± ε) (right, left), `wheel_radius` r(1 + ε),
/// `track_width` D(1 + ε), `encoder_scale` 1 + s_R, 1 + s_L. Without these effects that of the robot file.
[[nodiscard]] DriveGeometry drive_geometry(const Robot& robot);

/// Gives `model` (of a differential drive, made with the track width of the geometry) the robot's geometry: with r the
/// nominal radius,
///   v = [r_R/2 r_L/2; r_R/D −r_L/D] ω,   [r/r_R r/r_L; ℓ r/r_R −ℓ r/r_L] τ = Y θ_L,
/// so that θ_L = r·[m, I, f1, f3] keeps its meaning; dry friction at the wheels follows the input matrix. The model is
/// left as it is where the robot has no such effect.
void apply_geometry(Model& model, const Robot& robot);

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Oracle of a drive: the gap, the noise floor, and the other effects that would explain it equally well.
#pragma once

#include <string>
#include <vector>

#include "tests/world/signals.hpp"

namespace wheelwright::reality {

/// The gap between the nominal model s = r(m v̇1 + f1 v1), ℓ(τ_R − τ_L) = r(I v̇2 + f3 v2) and a drive, in per cent of
/// the torque's RMS, both low-passed.
struct Gap {
  double before = 0.0;     ///< with the parameters of the healthy robot
  double after = 0.0;      ///< with parameters by least squares
  double r_squared = 0.0;  ///< of the fit, both channels together
  Eigen::Vector4d fitted;  ///< m, f1, I, f3 by least squares
};

/// Of noise-free signals.
[[nodiscard]] Gap measure_gap(const RobotDesign& robot, const Signals& clean, double beta);

/// RMS of what noise leaves in the healthy model's residual, per cent of the torque's RMS; `log` is what the sensors
/// made of `clean`.
[[nodiscard]] double noise_floor(const RobotDesign& robot, const Signals& clean, const Signals& log, double beta);

/// Fit of the nearest other effect.
struct Oracle {
  bool separable = true;
  std::string closest_rival;
  double excess = 0.0;    ///< variance that it leaves, in units of the noise variance, torque or pose, the larger
  double own_form = 0.0;  ///< share of the gap that the catalogue's own formula of the true effect leaves
  double floor_percent = 0.0;
  double beta = 20.0;  ///< of the filter, 1/s
};

/// Compares the catalogue's formula of every effect with what the world did, on noise-free signals: a rival is told
/// apart when the variance that it leaves, in torque or in pose, exceeds a tenth of the noise variance and four times
/// the noise of that excess. Nested effects (a rival of which the truth is a special case) do not count as rivals.
/// `truth` names the effects; `parametric` keeps the parameters of the nominal model at the healthy robot's.
[[nodiscard]] Oracle ask_oracle(const RobotDesign& robot, const Signals& clean, const std::vector<std::string>& truth,
                                bool parametric, double floor_percent, double beta);

}  // namespace wheelwright::reality

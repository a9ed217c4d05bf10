// SPDX-License-Identifier: Apache-2.0
/// \file
/// Output noise: the bound on what the residual of an output can be without a fault.
#pragma once

#include "core/warrant.hpp"
#include "identify/noise_level.hpp"

namespace wheelwright::commission {

/// The bound on what y − Yθ (for the torque residual τ_f − Y_f θ) can be without a fault, in one output.
struct OutputNoise {
  core::NoiseOrigin origin = core::NoiseOrigin::estimated;
  double bound = 0.0;     ///< for driving to come: n̄ with ē, what a detector's rows have as dy
  double learning = 0.0;  ///< for the rows of this log, from which the feasible set is made; what was seen needs
                          ///< no extrapolation, so it is the smaller of the two
  identify::ExtrapolatedBound how;                      ///< how `bound` came about, meaningful where estimated
  core::Warrant warrant = core::Warrant::extrapolated;  ///< of both bounds
};

}  // namespace wheelwright::commission

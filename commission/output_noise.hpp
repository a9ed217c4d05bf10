// SPDX-License-Identifier: Apache-2.0
/// \file
/// The bound on what an output's residual can be without a fault, and where it comes from.
#pragma once

#include <functional>

#include <wheelwright/bounds/minimax.hpp>
#include <wheelwright/core/warrant.hpp>
#include <wheelwright/identify/noise_level.hpp>

namespace wheelwright {

/// Where the noise bound ē of an output comes from.
enum class NoiseOrigin {
  declared,   ///< the sensors' declared bounds, propagated through the filter
  estimated,  ///< extrapolated from the residuals of this log (noise_level.hpp), on top of what is declared
};

/// The bound on what y − Yθ (for the torque residual τ_f − Y_f θ) can be without a fault, in one output.
struct OutputNoise {
  NoiseOrigin origin = NoiseOrigin::estimated;
  double bound = 0.0;     ///< for driving to come: n̄ with ē, what a detector's rows have as dy
  double learning = 0.0;  ///< for the rows of this log, from which the feasible set is made; what was seen needs
                          ///< no extrapolation, so it is the smaller of the two
  ExtrapolatedBound how;  ///< how `bound` came about, meaningful where estimated
  Warrant warrant = Warrant::extrapolated;  ///< of both bounds
};

/// The factor by which estimated bounds must grow for a set to be left, and a little more. `fit`, in units of the bounds,
/// tells it where it converged; else it is bisected between what `fit` proved, by `leaves_a_set`.
[[nodiscard]] double noise_that_leaves_a_set(const MinimaxFit& fit, const std::function<bool(double)>& leaves_a_set);

}  // namespace wheelwright

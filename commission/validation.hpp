// SPDX-License-Identifier: Apache-2.0
/// \file
/// A commissioned detector tried on rows that it has not seen.
#pragma once

#include <cstddef>
#include <vector>

#include <wheelwright/core/regression.hpp>
#include <wheelwright/detector/threshold.hpp>

namespace wheelwright {

/// What happened in one output.
struct OutputValidation {
  std::size_t instants = 0;
  std::size_t outside = 0;           ///< instants with ε outside [l, u]: false alarms, since the log is fault-free
  double coverage = 0.0;             ///< share of instants with ε inside [l, u]
  double coverage_noise_free = 0.0;  ///< share with τ_f inside the range of Y_f θ over the feasible set alone
  double nrmse = 0.0;                ///< rms ε / rms τ_f
  double utilisation = 0.0;          ///< max |ε − middle| / half width: near 0, the threshold can never fire
  double torque_rms = 0.0;           ///< unit of the output
  double residual_rms = 0.0;         ///< unit of the output
  double median_width = 0.0;         ///< median of u − l, unit of the output
  double median_width_box = 0.0;     ///< the same with the interval hull in place of the set
  double smallest_kappa = 0.0;  ///< smallest |κ| of ζ = κ·Yθ that some instant shows for certain, both directions
  Warrant warrant = Warrant::extrapolated;  ///< of the threshold that was tried
};

/// Walks `rows` and compares every instant with its threshold. κ: an instant shows ζ = κ·Yθ for certain when
/// |κ|·min|Yθ| exceeds u − l, the minimum taken over the feasible set (theory section 5); a constant change δ1 of the
/// wheel radius r has κ = (1 + δ1/r)² − 1.
[[nodiscard]] std::vector<OutputValidation> validate_on(RegressionSource& rows, const ThresholdRule& rule);

}  // namespace wheelwright

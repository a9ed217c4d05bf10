// SPDX-License-Identifier: Apache-2.0
/// \file
/// The paper's dead-zone residual functions.
#pragma once

#include <cmath>

namespace wheelwright {

/// D1[ε] of (35) with the time-varying threshold ρ >= 0, and D2[ε] of (39) with a constant μ_o in its place:
/// |ε| where |ε| > threshold, else 0. The size tells how far the threshold was exceeded (Remark 6).
inline double dead_zone(double residual, double threshold) noexcept {
  const double size = std::abs(residual);
  return size > threshold ? size : 0.0;
}

/// The two-sided form: |ε| where ε lies outside [lower, upper], else 0.
inline double dead_zone(double residual, double lower, double upper) noexcept {
  return residual < lower || residual > upper ? std::abs(residual) : 0.0;
}

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/commission/output_noise.hpp>

#include <algorithm>
#include <cmath>

namespace wheelwright {

double noise_that_leaves_a_set(const MinimaxFit& fit, const std::function<bool(double)>& leaves_a_set) {
  constexpr double kAbove = 1.05;
  double lower = std::max(1.0, fit.lower), upper = fit.upper;
  while (!fit.converged && upper > kAbove * lower) {
    const double middle = std::sqrt(lower * upper);
    (leaves_a_set(middle) ? upper : lower) = middle;
  }
  return kAbove * upper;
}

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/noise_level.hpp>

#include <algorithm>
#include <cmath>

#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

#include <wheelwright/core/check.hpp>

namespace wheelwright {

ExtrapolatedBound extrapolate(const OutputResidual& residual, std::size_t instants,
                              const ExtrapolationOptions& options) {
  check::that(options.risk > 0.0 && options.risk < 1.0, "extrapolation risk", "a number inside (0, 1)");
  check::positive(options.horizon, "extrapolation horizon");
  check::that(instants > 0, "extrapolation", "at least one instant");
  namespace bm = boost::math;
  const double n = std::max(residual.effective_instants, 1.0);
  const double spread = std::sqrt(n / bm::quantile(bm::chi_squared(n), options.risk));
  const auto z = [&](double count) {
    return bm::quantile(bm::complement(bm::normal(), std::min(0.25, options.risk / (2.0 * count))));
  };
  const auto seen = static_cast<double>(instants);
  ExtrapolatedBound result;
  result.bound = residual.rms * spread * z(seen * std::max(options.horizon, 1.0));
  result.heavy_tail = residual.largest > residual.rms * spread * z(seen);
  if (result.heavy_tail) {
    result.bound =
        std::max(result.bound, residual.largest + residual.rms * std::log(std::max(options.horizon, 1.0) / options.risk));
  }
  result.over_largest = residual.largest > 0.0 ? result.bound / residual.largest : 0.0;
  result.over_rms = residual.rms > 0.0 ? result.bound / residual.rms : 0.0;
  return result;
}

double student_quantile(double confidence, double freedom) {
  check::that(confidence > 0.0 && confidence < 1.0, "confidence", "a number inside (0, 1)");
  check::positive(freedom, "degrees of freedom");
  return boost::math::quantile(boost::math::students_t(freedom), 0.5 + 0.5 * confidence);
}

}  // namespace wheelwright

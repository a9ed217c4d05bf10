// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/error_bound.hpp>

#include <cmath>
#include <numbers>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/statistics.hpp>

namespace wheelwright {

std::string_view to_string(NoiseLaw law) {
  switch (law) {
    case NoiseLaw::uniform: return "uniform";
    case NoiseLaw::gaussian: return "gaussian";
    case NoiseLaw::any_variance: return "any_variance";
  }
  return "";
}

ErrorBound bound_of_sd(double sd, double relative_sd, const ErrorBoundOptions& options) {
  check::non_negative(sd, "standard deviation");
  check::non_negative(relative_sd, "relative standard error");
  check::that(options.risk > 0.0 && options.risk < 1.0, "risk", "a number inside (0, 1)");
  check::that(options.horizon >= 1.0 && std::isfinite(options.horizon), "horizon", "a number >= 1");
  ErrorBound result;
  result.sd_limit = sd;
  if (relative_sd > 0.0) {
    const double freedom = 2.0 / (relative_sd * relative_sd);
    const double risk = options.law == NoiseLaw::uniform ? options.risk : 0.5 * options.risk;
    result.sd_limit = sd * std::sqrt(freedom / chi_squared_quantile(freedom, risk));
  }
  switch (options.law) {
    case NoiseLaw::uniform: result.factor = std::numbers::sqrt3; break;
    case NoiseLaw::gaussian: result.factor = normal_upper_quantile(0.25 * options.risk / options.horizon); break;
    case NoiseLaw::any_variance: result.factor = std::sqrt(2.0 * options.horizon / options.risk); break;
  }
  result.bound = result.factor * result.sd_limit;
  return result;
}

}  // namespace wheelwright

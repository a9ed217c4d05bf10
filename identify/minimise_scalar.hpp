// SPDX-License-Identifier: Apache-2.0
/// \file
/// Minimisation of an expensive function of one variable.
#pragma once

#include <cstddef>
#include <functional>

namespace wheelwright::identify {

/// Stopping rules of the search.
struct ScalarSearchOptions {
  std::size_t most_evaluations = 16;  ///< of the function; >= 1
  double tolerance = 1e-3;            ///< of the argument, its unit
};

/// Status of the search.
enum class ScalarSearchStatus {
  converged,      ///< steps became smaller than the tolerance
  out_of_budget,  ///< all evaluations were used
  stalled,        ///< rounding, or a function without finite values, left nothing to search
};

/// The best point that was met; +∞ as `value` where the function was nowhere finite.
struct ScalarMinimum {
  ScalarSearchStatus status = ScalarSearchStatus::stalled;
  double x = 0.0;
  double value = 0.0;
  std::size_t evaluations = 0;
};

/// Searches [lower, upper] for a least value of `f` from `start` on, with steps of a quarter of the interval at first:
/// NLopt's subplex method (Rowan 1990), which uses no derivatives. A value that is not finite counts as worse than any
/// other. The result is never worse than f(start), and is a minimum of the whole interval where f falls and rises once.
/// Exceptions of `f` pass through. Throws InvalidArgument unless lower < upper, both finite, lower <= start <= upper,
/// and the options are positive.
[[nodiscard]] ScalarMinimum minimise_scalar(const std::function<double(double)>& f, double lower, double upper,
                                            double start, const ScalarSearchOptions& options = {});

}  // namespace wheelwright::identify

// SPDX-License-Identifier: Apache-2.0
#include "identify/minimise_scalar.hpp"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <vector>

#include <nlopt.hpp>

#include "core/check.hpp"

namespace wheelwright::identify {
namespace {

constexpr double kWorse = 1e300;  // NLopt wants finite numbers

struct Search {
  const std::function<double(double)>& f;
  ScalarMinimum best;
  std::exception_ptr thrown;

  static double evaluate(const std::vector<double>& x, std::vector<double>& /*gradient*/, void* data) {
    auto& search = *static_cast<Search*>(data);
    ++search.best.evaluations;
    double value = kWorse;
    try {
      value = search.f(x[0]);
    } catch (...) {
      search.thrown = std::current_exception();
      throw nlopt::forced_stop();
    }
    if (!std::isfinite(value)) {
      return kWorse;
    }
    if (value < search.best.value) {
      search.best.value = value;
      search.best.x = x[0];
    }
    return value;
  }
};

}  // namespace

ScalarMinimum minimise_scalar(const std::function<double(double)>& f, double lower, double upper, double start,
                              const ScalarSearchOptions& options) {
  check::finite(lower, "lower");
  check::finite(upper, "upper");
  check::that(lower < upper, "lower", "less than upper");
  check::that(start >= lower && start <= upper, "start", "a number between lower and upper");
  check::that(options.most_evaluations >= 1, "most_evaluations", "at least 1");
  check::positive(options.tolerance, "tolerance");
  Search search{f, {}, nullptr};
  search.best.x = start;
  search.best.value = std::numeric_limits<double>::infinity();
  std::vector<double> x{start};
  double value = 0.0;
  try {
    nlopt::opt solver(nlopt::LN_SBPLX, 1);
    solver.set_lower_bounds(lower);
    solver.set_upper_bounds(upper);
    solver.set_initial_step(0.25 * (upper - lower));
    solver.set_xtol_rel(0.0);
    solver.set_xtol_abs(options.tolerance);
    solver.set_maxeval(static_cast<int>(std::min<std::size_t>(options.most_evaluations, 1000000)));
    solver.set_min_objective(Search::evaluate, &search);
    const nlopt::result how = solver.optimize(x, value);
    search.best.status =
        how == nlopt::MAXEVAL_REACHED ? ScalarSearchStatus::out_of_budget : ScalarSearchStatus::converged;
  } catch (const nlopt::roundoff_limited&) {
    search.best.status = ScalarSearchStatus::stalled;
  } catch (const nlopt::forced_stop&) {
    search.best.status = ScalarSearchStatus::stalled;
  }
  if (search.thrown) {
    std::rethrow_exception(search.thrown);
  }
  if (!std::isfinite(search.best.value)) {
    search.best.status = ScalarSearchStatus::stalled;
  }
  return search.best;
}

}  // namespace wheelwright::identify

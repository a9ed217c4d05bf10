// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/design/search.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include <nlopt.hpp>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/error.hpp>
#include <wheelwright/core/for_all.hpp>

namespace wheelwright {
namespace {

using Function = std::function<double(std::span<const double>)>;

constexpr double kNowhere = 1e300;  // where f is not defined

double value_at(const Function& f, std::span<const double> x) {
  try {
    const double value = f(x);
    return std::isfinite(value) ? value : kNowhere;
  } catch (const InvalidArgument&) {
    return kNowhere;
  }
}

// A number in [0, 1) that is the same with every standard library.
double uniform(std::mt19937_64& generator) { return static_cast<double>(generator() >> 11) * 0x1p-53; }

struct Descent {
  const Function* f;
  SearchResult best;

  static double evaluate(const std::vector<double>& x, std::vector<double>&, void* data) {
    auto& self = *static_cast<Descent*>(data);
    const double value = value_at(*self.f, x);
    ++self.best.evaluations;
    if (value < self.best.value) {
      self.best.value = value;
      self.best.x = x;
    }
    return value;
  }

  // Simplices that begin anew, smaller, where the last one stood still.
  void run(std::size_t steps, double tolerance) {
    const std::size_t last = best.evaluations + steps;
    double reach = 0.2;
    while (best.evaluations < last) {
      const double before = best.value;
      descend(reach, last - best.evaluations, tolerance);
      reach *= 0.5;
      if (before - best.value <= tolerance * std::abs(before) && reach < 0.04) {
        return;
      }
    }
  }

  void descend(double reach, std::size_t steps, double tolerance) {
    nlopt::opt solver(nlopt::LN_NELDERMEAD, static_cast<unsigned>(best.x.size()));
    solver.set_lower_bounds(0.0);
    solver.set_upper_bounds(1.0);
    solver.set_initial_step(reach);
    solver.set_ftol_rel(tolerance);
    solver.set_xtol_abs(1e-4);
    solver.set_maxeval(static_cast<int>(std::min<std::size_t>(steps, 1000000)));
    solver.set_min_objective(evaluate, this);
    std::vector<double> x = best.x;
    double value = 0.0;
    try {
      solver.optimize(x, value);
    } catch (const nlopt::roundoff_limited&) {
      // The best point met is kept in any case.
    }
  }
};

}  // namespace

SearchResult minimise_over_cube(const Function& f, std::size_t dimension,
                                const std::vector<std::vector<double>>& starts, const SearchOptions& options) {
  check::that(dimension > 0, "dimension", "at least 1");
  check::that(options.samples + starts.size() > 0, "samples", "a point to begin with");
  std::vector<std::vector<double>> points = starts;
  std::mt19937_64 generator(options.seed);
  for (std::size_t i = 0; i < options.samples; ++i) {
    std::vector<double> x(dimension);
    std::generate(x.begin(), x.end(), [&generator] { return uniform(generator); });
    points.push_back(std::move(x));
  }
  for (const auto& x : points) {
    check::that(x.size() == dimension, "starts", "points of the cube's dimension");
  }
  const double work = static_cast<double>(points.size() + options.descents * options.steps);
  const auto tell = [&](double evaluations) {
    if (options.progress) {
      options.progress(evaluations / work);
    }
  };

  std::vector<double> values(points.size());
  for_all(
      points.size(), options.threads, [&](std::size_t i) { values[i] = value_at(f, points[i]); },
      [&](std::size_t i) { tell(static_cast<double>(i)); });
  std::vector<std::size_t> order(points.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });

  const std::size_t count = std::max<std::size_t>(1, std::min(options.descents, points.size()));
  std::vector<Descent> descents(count);
  for (std::size_t i = 0; i < count; ++i) {
    descents[i] = {&f, {points[order[i]], values[order[i]], 0}};
  }
  if (options.descents > 0) {
    for_all(
        count, options.threads, [&](std::size_t i) { descents[i].run(options.steps, options.tolerance); },
        [&](std::size_t i) { tell(static_cast<double>(points.size() + i * options.steps)); });
  }
  const auto best = std::min_element(descents.begin(), descents.end(),
                                     [](const Descent& a, const Descent& b) { return a.best.value < b.best.value; });
  check::that(best->best.value < kNowhere, "the function", "a finite value somewhere");
  SearchResult result = best->best;
  result.evaluations = points.size();
  for (const Descent& descent : descents) {
    result.evaluations += descent.best.evaluations;
  }
  return result;
}

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/tuned_shapes.hpp>

#include <algorithm>
#include <cmath>
#include <span>

#include <wheelwright/core/linear_algebra.hpp>
#include <wheelwright/design/search.hpp>
#include <wheelwright/gap/causes_model.hpp>

namespace wheelwright {
namespace {

std::size_t continuous_shapes(const Effect& effect) {
  return static_cast<std::size_t>(std::ranges::count(effect.shapes, false, &ShapeParameter::discrete));
}

// The best set that has a candidate of `effect`; null where none has.
const CauseSet* best_with(std::size_t effect, const CandidateTable& table, const std::vector<CauseSet>& sets) {
  const CauseSet* best = nullptr;
  for (const CauseSet& set : sets) {
    const bool has =
        std::ranges::any_of(set.members, [&](std::size_t member) { return table.candidates[member].effect == effect; });
    if (has && (best == nullptr || set.held_out_error < best->held_out_error)) {
      best = &set;
    }
  }
  return best;
}

double error_without(std::size_t effect, const CandidateTable& table, const CauseSet& set) {
  const auto member =
      std::ranges::find_if(set.members, [&](std::size_t c) { return table.candidates[c].effect == effect; });
  const auto k = static_cast<std::size_t>(member - set.members.begin());
  return evaluate_without(table, set, k, BaseModel::refitted).held_out_error;
}

double to_cube(const FreeShape& range, double value) {
  return range.logarithmic ? std::log(value / range.lower) / std::log(range.upper / range.lower)
                           : (value - range.lower) / (range.upper - range.lower);
}

double from_cube(const FreeShape& range, double x) {
  return range.logarithmic ? range.lower * std::pow(range.upper / range.lower, x)
                           : range.lower + x * (range.upper - range.lower);
}

// The set's free shapes that leave least.
Eigen::VectorXd tuned(const CausesModel& model, const TuneOptions& options) {
  const auto shape_at = [&model](std::span<const double> x) {
    Eigen::VectorXd shape(model.shapes());
    for (std::size_t k = 0; k < x.size(); ++k) {
      shape[static_cast<Eigen::Index>(k)] = from_cube(model.free()[k], x[k]);
    }
    return shape;
  };
  const auto left = [&](std::span<const double> x) {
    SeparableValues at;
    model.evaluate(shape_at(x), false, at);
    const Eigen::VectorXd y = model.response() - at.offset;
    const Eigen::VectorXd rotated = QrFactors(at.columns).rotate(y);
    return rotated.tail(rotated.size() - at.columns.cols()).squaredNorm() / static_cast<double>(y.size());
  };
  std::vector<double> start;
  for (Eigen::Index k = 0; k < model.shapes(); ++k) {
    start.push_back(std::clamp(to_cube(model.free()[static_cast<std::size_t>(k)], model.start()[k]), 0.0, 1.0));
  }
  SearchOptions search;
  search.samples = options.samples;
  search.descents = options.descents;
  search.steps = options.steps;
  search.seed = options.seed;
  search.threads = options.threads;
  return shape_at(minimise_over_cube(left, start.size(), {start}, search).x);
}

}  // namespace

void add_tuned_shapes(ShapeGrids& grids, const PreparedGap& prepared, const GapProblem& problem,
                      const std::vector<CauseSet>& looked_at, const TuneOptions& options) {
  for (std::size_t e = 0; e < prepared.catalogue.size(); ++e) {
    if (continuous_shapes(prepared.catalogue[e]) < options.shapes) {
      continue;
    }
    const CauseSet* set = best_with(e, problem.table, looked_at);
    if (set == nullptr || set->held_out_error > (1.0 - options.gain) * error_without(e, problem.table, *set)) {
      continue;
    }
    const CausesModel model(prepared, problem, *set, BaseModel::refitted);
    const Eigen::VectorXd shape = tuned(model, options);
    for (std::size_t k = 0; k < model.members().size(); ++k) {
      if (!prepared.catalogue[model.members()[k].effect].shapes.empty()) {
        grids[model.members()[k].effect].push_back(model.shape_of(k, shape));
      }
    }
  }
}

}  // namespace wheelwright

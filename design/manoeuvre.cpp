// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/design/manoeuvre.hpp>

#include <algorithm>
#include <span>
#include <vector>

#include <wheelwright/core/error.hpp>
#include <wheelwright/design/search.hpp>
#include <wheelwright/design/stages.hpp>

namespace wheelwright {
namespace {

// Straight at full speed and turning on the spot at full speed, by turns: what a person would try first.
std::vector<double> by_turns(std::size_t stages, std::size_t joints) {
  std::vector<double> x;
  for (std::size_t k = 0; k < stages; ++k) {
    for (std::size_t j = 0; j < joints; ++j) {
      const bool backwards = k % 4 == 1 || (k % 4 == 2 && j % 2 == 1) || (k % 4 == 3 && j % 2 == 0);
      x.push_back(backwards ? 0.0 : 1.0);
    }
    x.push_back(0.5);
  }
  return x;
}

}  // namespace

Manoeuvre design_manoeuvre(const DesignSubject& subject, const MotionLimits& limits, const RowObjective& objective,
                           const DesignOptions& options) {
  return design_manoeuvre(subject, limits, of_rows(objective, subject), options);
}

Manoeuvre design_manoeuvre(const DesignSubject& subject, const MotionLimits& limits, const PlanObjective& objective,
                           const DesignOptions& options) {
  const StageFamily family(subject, limits, options.stages);
  const auto value_with = [&](double step) {
    return [&, step](std::span<const double> x) { return objective(family.plan(x, step)); };
  };
  const auto tell = [&options](const char* stage, double from, double length) {
    return [&options, stage, from, length](double share) {
      if (options.progress) {
        options.progress(stage, from + length * share);
      }
    };
  };
  SearchOptions search{.samples = options.samples,
                       .descents = options.descents,
                       .steps = options.steps,
                       .tolerance = 1e-4,
                       .seed = options.seed,
                       .threads = options.threads,
                       .progress = tell("searching manoeuvres", 0.0, 0.8)};
  const double coarse = std::max(options.coarse_step, subject.step);
  const SearchResult found = minimise_over_cube(value_with(coarse), family.dimension(),
                                                {by_turns(options.stages, subject.model.joints.size())}, search);
  search.samples = 0;
  search.descents = 1;
  search.progress = tell("refining the best one", 0.8, 0.2);
  const SearchResult refined = minimise_over_cube(value_with(subject.step), family.dimension(), {found.x}, search);

  Manoeuvre manoeuvre;
  manoeuvre.plan = family.plan(refined.x, subject.step);
  manoeuvre.use = limit_use(manoeuvre.plan, subject, limits);
  manoeuvre.objective = refined.value;
  manoeuvre.evaluations = found.evaluations + refined.evaluations;
  return manoeuvre;
}

BoundsDesign design_for_bounds(const DesignSubject& subject, const MotionLimits& limits, WidthCriterion criterion,
                               const DesignOptions& options) {
  BoundsDesign design;
  design.criterion = criterion;
  const RowObjective objective = narrow_bounds(subject, criterion);
  design.manoeuvre = design_manoeuvre(subject, limits, objective, options);
  design.promised = promised_bounds(planned_rows(design.manoeuvre.plan, subject), subject);
  if (subject.model.name == "differential_drive") {
    design.figure_eight = find_figure_eight(subject, limits, of_rows(objective, subject));
  }
  if (design.figure_eight) {
    design.figure_eight_plan = plan_of(*design.figure_eight, subject, limits.duration, subject.step);
    design.promised_eight = promised_bounds(planned_rows(*design.figure_eight_plan, subject), subject);
  }
  return design;
}

}  // namespace wheelwright

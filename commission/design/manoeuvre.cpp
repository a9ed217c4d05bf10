// SPDX-License-Identifier: Apache-2.0
#include "commission/design/manoeuvre.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

#include "commission/at_risk/risk_set.hpp"
#include "commission/design/risk_promise.hpp"
#include "commission/design/stages.hpp"
#include "commission/design/subject.hpp"
#include "core/check.hpp"
#include "core/error.hpp"

namespace wheelwright::design {
namespace {

constexpr double kFirstZeroOfJ0 = 2.404825557695773;
constexpr double kRamp = 1.0;        // s from rest, and to rest
constexpr double kRestAtEnds = 0.1;  // s of standstill at both ends
constexpr double kStep = 0.02;       // s, for the search

struct Window {
  double value = 0.0;
  double rate = 0.0;
};

Window smooth_step(double t) {
  if (t <= 0.0 || t >= kRamp) {
    return {t <= 0.0 ? 0.0 : 1.0, 0.0};
  }
  const double s = t / kRamp;
  return {s * s * (3.0 - 2.0 * s), 6.0 * s * (1.0 - s) / kRamp};
}

}  // namespace

Plan plan_of(const FigureEight& eight, const DesignSubject& subject, double duration, double step) {
  check::that(subject.model.on_two_wheels, "figure eight: the model", "a differential drive");
  check::positive(eight.period, "period");
  const double w = 2.0 * std::numbers::pi / eight.period;
  Plan plan;
  plan.step = step;
  const auto samples = static_cast<Eigen::Index>(std::floor(duration / step * (1.0 + 1e-12))) + 1;
  plan.speed.resize(2, samples);
  plan.acceleration.resize(2, samples);
  for (Eigen::Index k = 0; k < samples; ++k) {
    const double t = plan.t(k) - kRestAtEnds, left = duration - kRestAtEnds - plan.t(k);
    const Window begin = smooth_step(t), end = smooth_step(left);
    const Window window{begin.value * end.value, begin.rate * end.value - begin.value * end.rate};
    const double yaw = kFirstZeroOfJ0 * w * std::cos(w * t), yaw_rate = -kFirstZeroOfJ0 * w * w * std::sin(w * t);
    plan.speed.col(k) << eight.speed * window.value, yaw * window.value;
    plan.acceleration.col(k) << eight.speed * window.rate, yaw_rate * window.value + yaw * window.rate;
  }
  integrate_pose(plan, subject.model);
  return plan;
}

std::optional<FigureEight> find_figure_eight(const DesignSubject& subject, const MotionLimits& limits,
                                             const PlanObjective& objective) {
  validate(limits);
  const auto within = [&](const FigureEight& eight) {
    return limit_use(plan_of(eight, subject, limits.duration, kStep), subject, limits).largest() <= 1.0;
  };
  FigureEight best;
  double least = std::numeric_limits<double>::infinity();
  const double fastest = subject.robot.wheel_radius * limits.joint_speed;
  for (double period = 0.25; period <= 2.0 * limits.duration; period *= 1.125) {
    if (!within({0.0, period})) {
      continue;
    }
    double low = 0.0, high = fastest;
    for (int i = 0; i < 12; ++i) {
      const double middle = 0.5 * (low + high);
      (within({middle, period}) ? low : high) = middle;
    }
    for (const double share : {1.0, 0.85, 0.7, 0.5, 0.3}) {
      const FigureEight eight{share * low, period};
      const double value = objective(plan_of(eight, subject, limits.duration, kStep));
      if (value < least) {
        least = value;
        best = eight;
      }
    }
  }
  return std::isfinite(least) ? std::optional(best) : std::nullopt;
}

FigureEight best_figure_eight(const DesignSubject& subject, const MotionLimits& limits,
                              const PlanObjective& objective) {
  const std::optional<FigureEight> best = find_figure_eight(subject, limits, objective);
  if (!best) {
    throw InvalidArgument("limits: no figure eight is within them: expected a higher limit or more time");
  }
  return *best;
}

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

DesignOptions sized_for(PlanCost cost, DesignOptions options) {
  if (cost == PlanCost::five_walks) {
    options.samples = 120;
    options.descents = 2;
    options.steps = 150;
  } else if (cost == PlanCost::walk_each) {
    options.samples = 150;
    options.descents = 3;
    options.steps = 250;
  }
  return options;
}

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
  design.guarantee = options.guarantee;
  const PlanObjective objective = options.guarantee == Promise::at_risk
                                      ? narrow_bounds_at_risk(subject, criterion)
                                      : of_rows(narrow_bounds(subject, criterion), subject);
  const auto at_risk = [&](const Plan& plan) {
    return subject.averaging ? std::optional(promised_bounds_at_risk(plan, subject)) : std::nullopt;
  };
  design.manoeuvre = design_manoeuvre(subject, limits, objective, options);
  design.promised = promised_bounds(planned_rows(design.manoeuvre.plan, subject), subject);
  design.risk = commission::RiskSetOptions{}.risk;
  design.at_risk = at_risk(design.manoeuvre.plan);
  design.at_risk_warrant = subject.averaging_warrant;
  if (subject.model.on_two_wheels) {
    design.figure_eight = find_figure_eight(subject, limits, objective);
  }
  if (design.figure_eight) {
    design.figure_eight_plan = plan_of(*design.figure_eight, subject, limits.duration, subject.step);
    design.promised_eight = promised_bounds(planned_rows(*design.figure_eight_plan, subject), subject);
    design.at_risk_eight = at_risk(*design.figure_eight_plan);
  }
  return design;
}

}  // namespace wheelwright::design

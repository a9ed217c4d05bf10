// SPDX-License-Identifier: Apache-2.0
/// \file
/// Design of a manoeuvre: the best member of a family for a stated objective, and the figure eight that it is compared
/// with.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string_view>

#include "commission/design/plan.hpp"
#include "core/warrant.hpp"

namespace wheelwright::design {

/// A figure eight: constant speed V with v2 = j·w cos(wt), w = 2π/period, j = 2.405 the first zero of the Bessel
/// function J0, for which it closes; from rest over one second and to rest over the last one.
struct FigureEight {
  double speed = 0.0;   ///< V, m/s
  double period = 0.0;  ///< s
};

/// The eight, sampled every `step` s over `duration` s. Throws InvalidArgument unless the model is a differential
/// drive.
[[nodiscard]] Plan plan_of(const FigureEight& eight, const DesignSubject& subject, double duration, double step);

/// The best of the figure eights within `limits` by `objective`: periods from a fourth of a second to twice the
/// duration in steps of an eighth, speeds of 0.3 to 1 times the largest that is possible with that period.
/// Throws InvalidArgument where none is within the limits.
[[nodiscard]] FigureEight best_figure_eight(const DesignSubject& subject, const MotionLimits& limits,
                                            const PlanObjective& objective);

/// The same where there is one within the limits; else nothing.
[[nodiscard]] std::optional<FigureEight> find_figure_eight(const DesignSubject& subject, const MotionLimits& limits,
                                                           const PlanObjective& objective);

/// In which sense a plan's promises hold.
enum class Promise {
  every_noise,  ///< whatever the noise does within its bounds
  at_risk,      ///< but for a stated chance, where errors average out (docs/methods/risk.md)
};

/// Options of design_manoeuvre().
struct DesignOptions {
  Promise guarantee = Promise::every_noise;  ///< the promise that is to be good; both are told
  std::size_t stages = 4;                    ///< of constant speed in each half (stages.hpp)
  std::size_t samples = 400;                 ///< random manoeuvres looked at
  std::size_t descents = 6;                  ///< improved by local search
  std::size_t steps = 500;                   ///< evaluations each
  double coarse_step = 0.02;                 ///< s: sampling while searching, unless the log's own step is larger
  std::uint64_t seed = 1;
  std::size_t threads = 1;                                                  ///< the result does not depend on it
  std::function<void(std::string_view stage, double share)> progress = {};  ///< may be empty
};

/// What the objective asks of one plan.
enum class PlanCost {
  one_walk,    ///< of the plan: bounds
  five_walks,  ///< bounds at a stated risk
  walk_each,   ///< one for each fault, or for each rival
};

/// The cost of bounds under that promise.
[[nodiscard]] constexpr PlanCost cost_of_bounds(Promise promise) {
  return promise == Promise::at_risk ? PlanCost::five_walks : PlanCost::one_walk;
}

/// `options` with the size of search that commands take for objectives of that cost.
[[nodiscard]] DesignOptions sized_for(PlanCost cost, DesignOptions options);

/// A designed manoeuvre.
struct Manoeuvre {
  Plan plan;                    ///< sampled every DesignSubject::step
  LimitUse use;                 ///< of the limits: all <= 1
  double objective = 0.0;       ///< of the plan
  std::size_t evaluations = 0;  ///< plans looked at
};

/// The plan within `limits` with the smallest `objective` that was found: a search from many starts (stages.hpp) over
/// StageFamily, then a last local search at the log's own sampling. Deterministic for a seed; a global minimum is not
/// promised. Throws InvalidArgument as StageFamily does.
[[nodiscard]] Manoeuvre design_manoeuvre(const DesignSubject& subject, const MotionLimits& limits,
                                         const PlanObjective& objective, const DesignOptions& options = {});
/// The same for an objective of the planned rows.
[[nodiscard]] Manoeuvre design_manoeuvre(const DesignSubject& subject, const MotionLimits& limits,
                                         const RowObjective& objective, const DesignOptions& options = {});

/// A manoeuvre for narrow bounds, and what it promises.
struct BoundsDesign {
  Manoeuvre manoeuvre;
  WidthCriterion criterion = WidthCriterion::geometric_mean;
  Box promised;                              ///< by the manoeuvre
  std::optional<FigureEight> figure_eight;   ///< the best one within the same limits (differential drive)
  std::optional<Plan> figure_eight_plan;     ///< its motion
  Box promised_eight;                        ///< by the figure eight; meaningful where there is one
  Promise guarantee = Promise::every_noise;  ///< the one that was planned for
  double risk = 0.0;                         ///< of `at_risk`: that the bounds will not hold the true parameters
  std::optional<Box> at_risk;  ///< promised at that risk; nothing where no errors are known to average out
  std::optional<Box> at_risk_eight;
  core::Warrant at_risk_warrant = core::Warrant::guaranteed;
};

/// design_manoeuvre() for narrow bounds under DesignOptions::guarantee, and the best figure eight within the same
/// limits beside it. Throws InvalidArgument where that is at_risk and DesignSubject::averaging is empty.
[[nodiscard]] BoundsDesign design_for_bounds(const DesignSubject& subject, const MotionLimits& limits,
                                             WidthCriterion criterion = WidthCriterion::geometric_mean,
                                             const DesignOptions& options = {});

}  // namespace wheelwright::design

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The figure eight that a designed manoeuvre is compared with.
#pragma once

#include <optional>

#include <wheelwright/design/limits.hpp>
#include <wheelwright/design/objective.hpp>
#include <wheelwright/design/plan.hpp>

namespace wheelwright {

/// A figure eight: constant speed V with v2 = j·w cos(wt), w = 2π/period, j = 2.405 the first zero of the Bessel function
/// J0, for which it closes; from rest over one second and to rest over the last one.
struct FigureEight {
  double speed = 0.0;   ///< V, m/s
  double period = 0.0;  ///< s
};

/// The eight, sampled every `step` s over `duration` s. Throws InvalidArgument unless the model is a differential drive.
[[nodiscard]] Plan plan_of(const FigureEight& eight, const DesignSubject& subject, double duration, double step);

/// The best of the figure eights within `limits` by `objective`: periods from a fourth of a second to twice the
/// duration in steps of an eighth, speeds of 0.3 to 1 times the largest that is possible with that period.
/// Throws InvalidArgument where none is within the limits.
[[nodiscard]] FigureEight best_figure_eight(const DesignSubject& subject, const MotionLimits& limits,
                                            const PlanObjective& objective);
/// The same for an objective of the planned rows.
[[nodiscard]] FigureEight best_figure_eight(const DesignSubject& subject, const MotionLimits& limits,
                                            const RowObjective& objective);

/// The same where there is one within the limits; else nothing.
[[nodiscard]] std::optional<FigureEight> find_figure_eight(const DesignSubject& subject, const MotionLimits& limits,
                                                           const PlanObjective& objective);

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// A bound on the robot's inertia from pairs of steps in a log, before there is a feasible set.
#pragma once

#include "bounds/box.hpp"
#include "core/log.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/motion_bound.hpp"
#include "model/filter/noise.hpp"
#include "model/model.hpp"

namespace wheelwright::commission {

/// What `log` says of 1/inertia (MotionBound::mobility) where efforts are held and each has a coordinate of its own. Of
/// two steps with the same friction, the second no slower, u1 − u2 <= m (a1 − a2) <= 2 m (limit of the accelerations).
/// Walks the log. `errors` as the rows have them, with motion.limit; every row counts, so none may lie outside of them.
/// Empty where that limit is, and where a coordinate has no such steps.
[[nodiscard]] filter::MotionBound thrust_bound(LogSource& log, const Model& model,
                                               const filter::Measurement& measurement,
                                               const filter::SignalErrors& errors);

/// Takes into `bound` what thrust_bound() found, if anything, for the parameters in `box`.
void sharpen(filter::MotionBound& bound, const filter::MotionBound& thrust, const Box& box);

}  // namespace wheelwright::commission

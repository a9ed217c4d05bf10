// SPDX-License-Identifier: Apache-2.0
#include "commission/refined_set.hpp"

#include <utility>

#include "commission/setting_rows.hpp"
#include "commission/thrust_bound.hpp"
#include "commission/validation.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::commission {

using filter::SignalErrors;

namespace {

bounds::OutlierResult set_of(LogSource& log, const Setting& s, Part part, const SignalErrors& errors,
                             std::size_t outliers) {
  TorqueRows rows = make_rows(log, s, errors);
  FoldedSource folded(rows, part, s.survey.rows, s.folds);
  if (outliers > 0) {
    return bounds::feasible_set_with_outliers(folded, s.prior, {.most = outliers, .set = {}});
  }
  bounds::OutlierResult result;
  result.set = feasible_set(folded, s.prior);
  return result;
}

double widths(const Box& hull, const Box& unit) {
  double sum = 0.0;
  for (std::size_t j = 0; j < hull.dimension(); ++j) {
    const double width = unit.sides[j].upper - unit.sides[j].lower;
    sum += width > 0.0 ? (hull.sides[j].upper - hull.sides[j].lower) / width : 0.0;
  }
  return sum / static_cast<double>(hull.dimension());
}

}  // namespace

RefinedSet refined_set(LogSource& log, const Setting& s, Part part, SignalErrors errors, std::size_t outliers) {
  constexpr int kPasses = 4;
  constexpr double kWorthAnother = 0.98;  // of the widths
  RefinedSet best;
  best.learning = best.driving = errors.motion;
  // Outliers are outside of all bounds, in pairs of steps too.
  const filter::MotionBound thrust =
      outliers > 0 ? filter::MotionBound{} : thrust_bound(log, s.model, s.measurement, errors);
  const bool thrusts = thrust.mobility.size() > 0;
  SignalErrors first = errors;
  sharpen(first.motion, thrust, s.prior);
  best.learning = first.motion;
  best.result = set_of(log, s, part, first, outliers);
  const bool declared = s.robot.limits.contains("acceleration");
  for (int pass = 1; pass < kPasses && errors.between_samples; ++pass) {
    if (best.result.set.status != FeasibleSet::Status::nonempty) {
      return best;
    }
    filter::MotionBound bound = filter::motion_bound(s.model, best.result.set.hull.sides);
    const bool heavy = bound.mobility.size() > 0;
    if (!heavy && !thrusts) {
      return best;
    }
    bound.effort = errors.motion.effort;
    if (heavy) {
      best.driving = bound;
      if (declared) {
        best.driving.limit = errors.motion.limit;
      }
    }
    sharpen(bound, thrust, best.result.set.hull);
    bound.limit = errors.motion.limit;
    SignalErrors sharper = errors;
    sharper.motion = bound;
    bounds::OutlierResult next = set_of(log, s, part, sharper, outliers);
    const bool better =
        next.set.status != FeasibleSet::Status::nonempty || widths(next.set.hull, best.result.set.hull) < kWorthAnother;
    best.earlier.push_back({std::move(best.result.set), std::move(best.result.dropped)});
    best.result = std::move(next);
    best.learning = bound;
    if (!better) {
      return best;
    }
  }
  return best;
}

}  // namespace wheelwright::commission

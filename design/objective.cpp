// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/design/objective.hpp>

#include <cmath>

#include <wheelwright/bounds/interval_hull.hpp>

namespace wheelwright {

Box promised_bounds(const RegressionBlock& rows, const DesignSubject& subject) {
  RegressionTable table(rows);
  return interval_hull(table, subject.prior).hull;
}

Eigen::VectorXd relative_widths(const Box& bounds, const DesignSubject& subject) {
  Eigen::VectorXd widths(subject.theta.size());
  for (Eigen::Index j = 0; j < widths.size(); ++j) {
    const Interval& side = bounds.sides[static_cast<std::size_t>(j)];
    const Interval& prior = subject.prior.sides[static_cast<std::size_t>(j)];
    const double scale = subject.theta[j] != 0.0 ? std::abs(subject.theta[j]) : prior.upper - prior.lower;
    widths[j] = scale > 0.0 ? (side.upper - side.lower) / scale : 0.0;
  }
  return widths;
}

double combined(const Eigen::VectorXd& widths, WidthCriterion criterion) {
  switch (criterion) {
    case WidthCriterion::geometric_mean: return std::exp(widths.array().max(1e-300).log().mean());
    case WidthCriterion::mean: return widths.mean();
    case WidthCriterion::largest: break;
  }
  return widths.maxCoeff();
}

PlanObjective of_rows(RowObjective objective, const DesignSubject& subject) {
  return
      [objective = std::move(objective), &subject](const Plan& plan) { return objective(planned_rows(plan, subject)); };
}

RowObjective narrow_bounds(const DesignSubject& subject, WidthCriterion criterion) {
  return [&subject, criterion](const RegressionBlock& rows) {
    return combined(relative_widths(promised_bounds(rows, subject), subject), criterion);
  };
}

}  // namespace wheelwright

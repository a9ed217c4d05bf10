// SPDX-License-Identifier: Apache-2.0
// What is promised before the drive: closed forms, and that no noise within the bounds makes it wider.
#include "commission/design/plan.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "bounds/interval_hull.hpp"
#include "commission/design/manoeuvre.hpp"
#include "commission/design/subject.hpp"
#include "core/error.hpp"
#include "tests/design/robots.hpp"

namespace wheelwright::design::objective_test {
namespace {

using testing_support::small_robot;

// Efforts that change at samples: what acts between two of them is known.
DesignSubject subject() {
  Robot robot = small_robot();
  robot.effort_changes = model::EffortChanges::at_samples;
  return subject_of(robot, 0.02);
}

TEST(Promise, RowsOfOneParameterEachHaveAClosedForm) {
  DesignSubject s = subject();
  RegressionBlock rows;
  rows.resize(4, 1, 4);
  rows.Y = Eigen::Vector4d(2.0, 4.0, 0.5, 1.0).asDiagonal().toDenseMatrix();
  rows.dY.setZero();
  rows.dy << 0.1, 0.1, 0.02, 0.03;
  rows.y = rows.Y * s.theta;
  for (std::size_t k = 0; k < 4; ++k) {
    rows.sample[k] = k;
    rows.t[k] = static_cast<double>(k);
  }
  const Box promised = promised_bounds(rows, s);
  for (std::size_t j = 0; j < 4; ++j) {
    const auto at = static_cast<Eigen::Index>(j);
    const double half = rows.dy[at] / rows.Y(at, at);
    EXPECT_NEAR(promised.sides[j].lower, std::max(s.theta[at] - half, s.prior.sides[j].lower), 1e-9);
    EXPECT_NEAR(promised.sides[j].upper, s.theta[at] + half, 1e-9);
  }
}

TEST(Promise, NoNoiseWithinTheBoundsGivesAWiderHull) {
  DesignSubject s = subject();
  for (Interval& side : s.prior.sides) {
    side = {-1e3, 1e3};  // the prior's own sides would hide what the rows do
  }
  RegressionBlock rows = planned_rows(plan_of({0.4, 6.0}, s, 12.0, 0.02), s);
  rows.dY.setZero();
  rows.dy.setConstant(0.05);
  const Box promised = promised_bounds(rows, s);
  std::mt19937_64 generator(5);
  const auto in_bounds = [&] { return 0.05 * (2.0 * static_cast<double>(generator() >> 11) * 0x1p-53 - 1.0); };
  for (int trial = 0; trial < 20; ++trial) {
    RegressionBlock noisy = rows;
    const double shift = in_bounds();
    for (Eigen::Index k = 0; k < noisy.y.size(); ++k) {
      noisy.y[k] += trial % 2 == 0 ? in_bounds() : shift;
    }
    core::RegressionTable table(noisy);
    const bounds::IntervalHull found = bounds::interval_hull(table, s.prior);
    ASSERT_FALSE(found.empty);
    for (std::size_t j = 0; j < 4; ++j) {
      const Interval &a = found.hull.sides[j], &b = promised.sides[j];
      // Both are rounded outward, each by its own certificate.
      EXPECT_LE(a.upper - a.lower, (b.upper - b.lower) * (1.0 + 1e-9)) << j;
    }
  }
}

TEST(Promise, PlannedRowsAreWithoutResidualAndCarryTheDeclaredNoise) {
  const DesignSubject s = subject();
  const RegressionBlock rows = planned_rows(plan_of({0.4, 6.0}, s, 12.0, 0.02), s);
  EXPECT_GT(rows.instants(), 500U);
  EXPECT_EQ((rows.y - rows.Y * s.theta).cwiseAbs().maxCoeff(), 0.0);
  // ē of the effort alone in the worst case: both wheels' bounds through a filter of gain 1 (sum), times D/2
  // (difference).
  for (Eigen::Index k = 0; k < rows.rows(); k += 2) {
    EXPECT_NEAR(rows.dy[k], 0.04, 1e-12);
    EXPECT_NEAR(rows.dy[k + 1], 0.5 * 0.381 * 0.04, 1e-12);
  }
  EXPECT_GT(rows.dY.maxCoeff(), 0.0);
}

// What efforts may do between two samples is planned for, by the efforts that the plan needs.
TEST(Promise, EffortsThatChangeBetweenSamplesCost) {
  const DesignSubject known = subject(), doubtful = subject_of(small_robot(), 0.02);
  const Plan plan = plan_of({0.4, 6.0}, known, 12.0, 0.02);
  const RegressionBlock a = planned_rows(plan, known), b = planned_rows(plan, doubtful);
  ASSERT_EQ(a.instants(), b.instants());
  EXPECT_TRUE(((b.dy - a.dy).array() >= 0.0).all());
  EXPECT_GT((b.dy - a.dy).maxCoeff(), 0.1 * a.dy.minCoeff());
  const Box promised = promised_bounds(a, known), less = promised_bounds(b, doubtful);
  for (std::size_t j = 0; j < 4; ++j) {
    EXPECT_LT(promised.sides[j].upper - promised.sides[j].lower, less.sides[j].upper - less.sides[j].lower) << j;
  }
}

// A plan may be looked at with longer steps than the log to come will have: the rows are those of the same motion.
TEST(Promise, ACoarserLookSeesTheSameMotion) {
  const DesignSubject s = subject_of(small_robot(), 0.005);
  const RegressionBlock fine = planned_rows(plan_of({0.4, 6.0}, s, 12.0, 0.005), s),
                        coarse = planned_rows(plan_of({0.4, 6.0}, s, 12.0, 0.02), s);
  ASSERT_GT(coarse.instants(), 500U);
  const double scale = fine.Y.cwiseAbs().maxCoeff();
  std::size_t k = 0, compared = 0;
  for (std::size_t c = 0; c < coarse.instants(); ++c) {
    while (k + 1 < fine.instants() && fine.t[k] < coarse.t[c] - 1e-9) {
      ++k;
    }
    if (std::abs(fine.t[k] - coarse.t[c]) < 1e-9) {
      const auto i = static_cast<Eigen::Index>(2 * c), j = static_cast<Eigen::Index>(2 * k);
      EXPECT_LT((coarse.Y.middleRows(i, 2) - fine.Y.middleRows(j, 2)).cwiseAbs().maxCoeff(), 0.1 * scale);
      ++compared;
    }
  }
  EXPECT_GT(compared, 500U);
}

TEST(Promise, CriteriaOfWidths) {
  const Eigen::Vector3d widths(1.0, 4.0, 16.0);
  EXPECT_NEAR(combined(widths, WidthCriterion::geometric_mean), 4.0, 1e-12);
  EXPECT_NEAR(combined(widths, WidthCriterion::mean), 7.0, 1e-12);
  EXPECT_EQ(combined(widths, WidthCriterion::largest), 16.0);
}

TEST(Promise, WhatIsNotKnownIsAskedFor) {
  Robot robot = small_robot();
  robot.nominal.erase("yaw_inertia");
  EXPECT_THROW(static_cast<void>(subject_of(robot, 0.01)), InvalidArgument);
  robot = small_robot();
  robot.noise.effort.value.reset();
  EXPECT_THROW(static_cast<void>(subject_of(robot, 0.01)), InvalidArgument);
}

TEST(FigureEightPlan, ClosesAndRests) {
  const DesignSubject s = subject();
  const Plan plan = plan_of({0.4, 5.0}, s, 22.0, 0.002);
  EXPECT_EQ(plan.speed.col(0), Eigen::Vector2d::Zero());
  EXPECT_EQ(plan.speed.col(plan.samples() - 1), Eigen::Vector2d::Zero());
  // Two periods apart; the arcs of a step err by O(step³).
  EXPECT_LT((plan.pose.col(7500) - plan.pose.col(2500)).norm(), 1e-5);
}

TEST(FigureEightPlan, TheBestOneKeepsToTheLimitsAndBeatsASlowerOne) {
  const DesignSubject s = subject();
  MotionLimits limits = limits_of(small_robot());
  limits.duration = 10.0;
  limits.radius = 0.8;
  const RowObjective objective = narrow_bounds(s, WidthCriterion::geometric_mean);
  const FigureEight best = best_figure_eight(s, limits, of_rows(objective, s));
  const Plan plan = plan_of(best, s, 10.0, 0.02);
  EXPECT_LE(limit_use(plan, s, limits).largest(), 1.0);
  const FigureEight slower{0.5 * best.speed, best.period};
  EXPECT_LT(objective(planned_rows(plan, s)), objective(planned_rows(plan_of(slower, s, 10.0, 0.02), s)));
}

}  // namespace
}  // namespace wheelwright::design::objective_test

// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <optional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/LU>
#include <Eigen/QR>

#include "core/error.hpp"
#include "identify/inference/constrained.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::inference::constrained_test {
namespace {

using ::testing::HasSubstr;
using testing_support::block_of;
using testing_support::Random;

identify::LeastSquares rows_of(const Eigen::MatrixXd& Y, const Eigen::VectorXd& y) {
  identify::LeastSquares rows(static_cast<std::size_t>(Y.cols()));
  rows.add(block_of(Y, y, 1));
  return rows;
}

double rss(const Eigen::MatrixXd& Y, const Eigen::VectorXd& y, const Eigen::VectorXd& theta) {
  return (y - Y * theta).squaredNorm();
}

/// The best of all solutions with some constraints as equations that fulfil the others: the minimum, whatever method.
std::optional<Eigen::VectorXd> best_of_all_active_sets(const Eigen::MatrixXd& Y, const Eigen::VectorXd& y,
                                                       const std::vector<LinearConstraint>& constraints) {
  const Eigen::Index p = Y.cols();
  std::optional<Eigen::VectorXd> best;
  for (std::size_t set = 0; set < (std::size_t{1} << constraints.size()); ++set) {
    std::vector<std::size_t> held;
    for (std::size_t i = 0; i < constraints.size(); ++i) {
      if ((set >> i & 1U) != 0) {
        held.push_back(i);
      }
    }
    const auto m = static_cast<Eigen::Index>(held.size());
    if (m > p) {
      continue;
    }
    Eigen::MatrixXd kkt = Eigen::MatrixXd::Zero(p + m, p + m);
    Eigen::VectorXd right(p + m);
    kkt.topLeftCorner(p, p) = Y.transpose() * Y;
    right.head(p) = Y.transpose() * y;
    for (Eigen::Index i = 0; i < m; ++i) {
      const LinearConstraint& constraint = constraints[held[static_cast<std::size_t>(i)]];
      kkt.row(p + i).head(p) = constraint.a.transpose();
      kkt.col(p + i).head(p) = constraint.a;
      right[p + i] = constraint.b;
    }
    const Eigen::FullPivLU<Eigen::MatrixXd> lu(kkt);
    if (!lu.isInvertible()) {
      continue;
    }
    const Eigen::VectorXd theta = lu.solve(right).head(p);
    bool feasible = true;
    for (const LinearConstraint& constraint : constraints) {
      feasible = feasible && constraint.a.dot(theta) <= constraint.b + 1e-9 * (1.0 + std::abs(constraint.b));
    }
    if (feasible && (!best || rss(Y, y, theta) < rss(Y, y, *best))) {
      best = theta;
    }
  }
  return best;
}

TEST(ConstrainedLeastSquares, IsTheBestOfAllActiveSets) {
  int bound = 0, infeasible = 0;
  for (std::uint64_t seed = 1; seed <= 300; ++seed) {
    Random random(seed);
    const auto p = static_cast<Eigen::Index>(1 + random.below(4));
    const std::size_t m = 1 + random.below(8);
    Eigen::MatrixXd Y = random.matrix(40, p);
    for (Eigen::Index j = 0; j < p; ++j) {
      Y.col(j) *= std::pow(10.0, static_cast<double>(j) - 1.0);
    }
    const Eigen::VectorXd y = Y * random.matrix(p, 1) + 0.1 * random.matrix(40, 1);
    std::vector<LinearConstraint> constraints;
    for (std::size_t i = 0; i < m; ++i) {
      constraints.push_back({random.matrix(p, 1), random.symmetric(), "c", ""});
    }
    const ConstrainedFit fit = constrained_least_squares(rows_of(Y, y), constraints);
    const auto expected = best_of_all_active_sets(Y, y, constraints);
    ASSERT_EQ(fit.status == ConstrainedStatus::infeasible, !expected.has_value()) << seed;
    if (!expected) {
      ++infeasible;
      // Farkas: Σ u a = 0 and Σ u b < 0.
      Eigen::VectorXd a = Eigen::VectorXd::Zero(p);
      double b = 0.0, size = 0.0;
      for (const ActiveConstraint& active : fit.active) {
        EXPECT_GT(active.multiplier, 0.0);
        a += active.multiplier * constraints[active.index].a;
        b += active.multiplier * constraints[active.index].b;
        size += active.multiplier * constraints[active.index].a.norm();
      }
      EXPECT_LT(a.norm(), 1e-8 * size);
      EXPECT_LT(b, 0.0);
      continue;
    }
    EXPECT_NEAR(rss(Y, y, fit.estimate), rss(Y, y, *expected), 1e-9 * y.squaredNorm()) << seed;
    EXPECT_LT((fit.estimate - *expected).norm(), 1e-7 * (1.0 + expected->norm())) << seed;
    EXPECT_NEAR(fit.weighted_rss, rss(Y, y, fit.estimate), 1e-10 * y.squaredNorm());
    EXPECT_LT(fit.kkt_residual, 1e-11) << seed;
    bound += fit.active.empty() ? 0 : 1;

    // The optimality conditions in plain numbers: Σ λ a = −∇, and only constraints that are touched have a λ.
    Eigen::VectorXd gradient = -2.0 * Y.transpose() * (y - Y * fit.estimate);
    for (const ActiveConstraint& active : fit.active) {
      const LinearConstraint& constraint = constraints[active.index];
      gradient += active.multiplier * constraint.a;
      EXPECT_GE(active.multiplier, 0.0);
      EXPECT_NEAR(constraint.a.dot(fit.estimate), constraint.b,
                  1e-9 * (1.0 + constraint.a.norm() * fit.estimate.norm()));
    }
    EXPECT_LT(gradient.cwiseQuotient(Y.colwise().norm().transpose()).norm(), 1e-9 * y.norm()) << seed;
  }
  EXPECT_GT(bound, 100);
  EXPECT_GT(infeasible, 10);
}

TEST(ConstrainedLeastSquares, WithoutBindingConstraintsItIsLeastSquares) {
  Random random(5);
  const Eigen::MatrixXd Y = random.matrix(100, 3);
  const Eigen::VectorXd y = Y * Eigen::Vector3d(1.0, 2.0, 3.0) + 0.1 * random.matrix(100, 1);
  const ConstrainedFit fit = constrained_least_squares(rows_of(Y, y), {{Eigen::Vector3d(-1.0, 0.0, 0.0), 0.0, "", ""}});
  EXPECT_TRUE(fit.active.empty());
  EXPECT_LT((fit.estimate - Y.householderQr().solve(y)).norm(), 1e-12);
  EXPECT_LT((constrained_least_squares(rows_of(Y, y), {}).estimate - fit.free_estimate).norm(), 1e-12);
}

// The multiplier is the price of the constraint: d rss/db = −λ, by differences of the solution itself.
TEST(ConstrainedLeastSquares, MultipliersArePrices) {
  Random random(6);
  const Eigen::MatrixXd Y = random.matrix(60, 3);
  const Eigen::VectorXd y = Y * Eigen::Vector3d(2.0, 2.0, 2.0) + random.matrix(60, 1);
  std::vector<LinearConstraint> constraints = {{Eigen::Vector3d(1.0, 0.0, 0.0), 1.0, "x", ""},
                                               {Eigen::Vector3d(3.0, 4.0, 0.0), 5.0, "xy", ""}};
  const ConstrainedFit fit = constrained_least_squares(rows_of(Y, y), constraints);
  ASSERT_FALSE(fit.active.empty());
  for (const ActiveConstraint& active : fit.active) {
    const auto rss_at = [&](double step) {
      auto moved = constraints;
      moved[active.index].b += step;
      return constrained_least_squares(rows_of(Y, y), moved).weighted_rss;
    };
    // rss is quadratic in b while the active set stays: the central difference is exact but for rounding.
    EXPECT_NEAR((rss_at(-1e-3) - rss_at(1e-3)) / 2e-3, active.multiplier, 1e-8 * (1.0 + active.multiplier));
  }
}

TEST(ConstrainedLeastSquares, FreeDirectionsAreSaid) {
  Random random(7);
  Eigen::MatrixXd Y = random.matrix(50, 3);
  Y.col(2) = Y.col(1);
  const Eigen::VectorXd y = Y * Eigen::Vector3d(1.0, 1.0, 1.0);
  const ConstrainedFit fit = constrained_least_squares(rows_of(Y, y), {{Eigen::Vector3d(0.0, 1.0, 0.0), 0.5, "", ""}});
  EXPECT_EQ(fit.status, ConstrainedStatus::undetermined);
  // Of the sum 2 of the last two, 0.5 may stand at the first of them.
  EXPECT_NEAR(fit.estimate[0], 1.0, 1e-9);
  EXPECT_NEAR(fit.estimate[1], 0.5, 1e-9);
  EXPECT_NEAR(fit.estimate[2], 1.5, 1e-9);
}

TEST(ConstrainedLeastSquares, DependentAndRepeatedConstraintsDoNoHarm) {
  Random random(8);
  const Eigen::MatrixXd Y = random.matrix(50, 2);
  const Eigen::VectorXd y = Y * Eigen::Vector2d(3.0, 3.0) + 0.01 * random.matrix(50, 1);
  // Five constraints through the corner (1, 1), one of them twice.
  std::vector<LinearConstraint> constraints;
  for (const Eigen::Vector2d& a : {Eigen::Vector2d(1.0, 0.0), Eigen::Vector2d(0.0, 1.0), Eigen::Vector2d(1.0, 1.0),
                                   Eigen::Vector2d(1.0, 0.0), Eigen::Vector2d(2.0, 1.0)}) {
    constraints.push_back({a, a.sum(), "", ""});
  }
  const ConstrainedFit fit = constrained_least_squares(rows_of(Y, y), constraints);
  EXPECT_LT((fit.estimate - Eigen::Vector2d::Ones()).norm(), 1e-12);
  EXPECT_EQ(fit.active.size(), 5u);
  EXPECT_LT(fit.kkt_residual, 1e-12);
}

TEST(PhysicalConsistency, TheFootprintBindsAndSaysSo) {
  // A robot of 20 kg whose log looks like I = 5 kg·m² in a footprint of R = 0.4 m: I <= 20·0.16 = 3.2.
  Random random(9);
  const double r = 0.1, R = 0.4;
  const std::vector<PhysicalQuantity> parameters = {{"mass", r, "kg", true},
                                                    {"yaw_inertia", r, "kg·m²", true},
                                                    {"viscous_linear", r, "N·s/m", true},
                                                    {"offset", 1.0, "N·m"}};
  const auto constraints = physical_consistency(parameters, R);
  ASSERT_EQ(constraints.size(), 4u);
  const Eigen::MatrixXd Y = random.matrix(500, 4);
  const Eigen::Vector4d truth(20.0 * r, 5.0 * r, 3.0 * r, -1.0);
  const Eigen::VectorXd y = Y * truth + 0.01 * random.matrix(500, 1);
  const identify::LeastSquares rows = rows_of(Y, y);
  const ConstrainedFit fit =
      constrained_least_squares(rows, constraints, rows.solve().inverse_gram * 0.01 * 0.01 / 3.0);
  ASSERT_EQ(fit.active.size(), 1u);
  EXPECT_NEAR(fit.estimate[1] / r, fit.estimate[0] / r * R * R, 1e-12 * fit.estimate[1] / r);
  EXPECT_THAT(
      fit.active[0].words,
      HasSubstr(
          "the log asks for an inertia larger than the footprint allows: yaw_inertia = mass·R² with R = 0.4 m binds"));
  EXPECT_GT(fit.active[0].excess_in_errors, 100.0);
  EXPECT_NEAR(fit.active[0].excess, 5.0 - 3.2, 0.1);
  EXPECT_LT(fit.estimate[3], 0.0);
}

TEST(PhysicalConsistency, KnowsWhatIsNeverNegative) {
  const auto constraints =
      physical_consistency({{"inertia", 2.0, "", true}, {"coulomb", 1.0, "", true}, {"offset", 1.0, ""}}, 1.0);
  ASSERT_EQ(constraints.size(), 2u);
  EXPECT_EQ(constraints[0].asks, "a negative inertia");
  EXPECT_EQ(constraints[0].a, Eigen::Vector3d(-0.5, 0.0, 0.0));
  EXPECT_THROW((void)physical_consistency({{"mass", 0.0, ""}}), InvalidArgument);
  EXPECT_THROW((void)physical_consistency({{"mass", 1.0, ""}}, -1.0), InvalidArgument);
  EXPECT_THROW((void)physical_consistency({}), InvalidArgument);
}

TEST(NonnegativeLeastSquares, FulfilsItsOptimalityConditions) {
  for (std::uint64_t seed = 1; seed <= 200; ++seed) {
    Random random(seed);
    const auto columns = static_cast<Eigen::Index>(1 + random.below(10));
    const auto rows = static_cast<Eigen::Index>(1 + random.below(6));
    const Eigen::MatrixXd E = random.matrix(rows, columns);
    const Eigen::VectorXd f = random.matrix(rows, 1);
    const Eigen::VectorXd x = nonnegative_least_squares(E, f);
    const Eigen::VectorXd slope = E.transpose() * (f - E * x);
    for (Eigen::Index j = 0; j < columns; ++j) {
      EXPECT_GE(x[j], 0.0);
      EXPECT_LE(slope[j], 1e-12);
      if (x[j] > 0.0) {
        EXPECT_NEAR(slope[j], 0.0, 1e-11);
      }
    }
  }
  EXPECT_THROW((void)nonnegative_least_squares(Eigen::MatrixXd::Ones(2, 2), Eigen::VectorXd::Ones(3)), InvalidArgument);
}

TEST(ConstrainedLeastSquares, MisuseIsRefused) {
  const identify::LeastSquares rows = rows_of(Eigen::MatrixXd::Identity(4, 2), Eigen::VectorXd::Ones(4));
  EXPECT_THROW((void)constrained_least_squares(rows, {{Eigen::Vector3d::Ones(), 0.0, "", ""}}), InvalidArgument);
  EXPECT_THROW((void)constrained_least_squares(rows, {{Eigen::Vector2d::Zero(), 0.0, "", ""}}), InvalidArgument);
  EXPECT_THROW((void)constrained_least_squares(rows, {{Eigen::Vector2d::Ones(), std::nan(""), "", ""}}),
               InvalidArgument);
  EXPECT_THROW((void)constrained_least_squares(rows, {}, Eigen::Matrix3d::Identity()), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::inference::constrained_test

// SPDX-License-Identifier: Apache-2.0
// Derivatives of the hull against the hull itself, solved anew beside the point.
#include <gtest/gtest.h>

#include "bounds/feasible_set.hpp"
#include "study/bound_derivatives.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::study::hull_derivatives_test {
namespace {

using testing_support::Random;

// Rows that are straight lines in s: one output, instants 0, 1, ….
struct Moving {
  RegressionBlock now, rate;
  Box prior;

  explicit Moving(std::size_t p, std::size_t rows = 0) { resize(rows, p); }
  void resize(std::size_t rows, std::size_t p) {
    for (RegressionBlock* block : {&now, &rate}) {
      block->resize(rows, 1, p);
      for (std::size_t k = 0; k < rows; ++k) {
        block->sample[k] = k;
        block->t[k] = 0.01 * static_cast<double>(k);
      }
      block->Y.setZero();
      block->dY.setZero();
      block->y.setZero();
      block->dy.setZero();
    }
    prior.sides.assign(p, {0.0, 10.0});
  }
  [[nodiscard]] core::RegressionTable at(double s) const {
    RegressionBlock block = now;
    block.Y += s * rate.Y;
    block.y += s * rate.y;
    block.dy += s * rate.dy;
    return core::RegressionTable(block);
  }
  [[nodiscard]] FeasibleSet set(double s) const {
    core::RegressionTable rows = at(s);
    return feasible_set(rows, prior);
  }
  [[nodiscard]] std::vector<RowRate> rates(const HullOptimum& optimum) const {
    std::vector<RowRate> rates;
    for (const bounds::WeightedRow& active : optimum.active) {
      const bounds::RowOrigin& origin = active.row.origin;
      if (origin.is_prior) {
        rates.push_back({});
        continue;
      }
      const auto k = static_cast<Eigen::Index>(origin.sample);
      const double sign = origin.side == bounds::Side::upper ? 1.0 : -1.0;
      rates.push_back({sign * rate.Y.row(k).transpose(), sign * rate.y[k] + rate.dy[k]});
    }
    return rates;
  }
  [[nodiscard]] HullOptima optima() const {
    HullOptima result = hull_optima(*set(0.0).polytope, prior);
    core::RegressionTable rows = at(0.0);
    add_active_rows(result, rows);
    return result;
  }
};

// θ_true inside, rows and their rates at random.
Moving random_set(std::uint64_t seed, std::size_t p, std::size_t rows) {
  Random random(seed);
  Moving moving(p, rows);
  Eigen::VectorXd truth(static_cast<Eigen::Index>(p));
  for (double& x : truth) {
    x = 1.0 + random.unit();
  }
  const auto n = static_cast<Eigen::Index>(rows), q = static_cast<Eigen::Index>(p);
  moving.now.Y = random.matrix(n, q);
  moving.now.dY = 0.02 * random.matrix(n, q).cwiseAbs();
  moving.now.dy = Eigen::VectorXd::Constant(n, 0.2) + 0.1 * random.matrix(n, 1);
  moving.now.y = moving.now.Y * truth + 0.1 * random.matrix(n, 1);
  moving.rate.Y = random.matrix(n, q);
  moving.rate.y = random.matrix(n, 1);
  moving.rate.dy = random.matrix(n, 1);
  return moving;
}

// Whether the one-sided derivatives are those of differences; the hull's curvature leaves O(step).
void expect_sides(const Moving& moving, const HullOptima& optima, double step, double tolerance) {
  const FeasibleSet before = moving.set(-step), now = moving.set(0.0), after = moving.set(step);
  for (std::size_t j = 0; j < moving.prior.dimension(); ++j) {
    for (const HullOptimum* optimum : {&optima.lower[j], &optima.upper[j]}) {
      const auto value = [&](const FeasibleSet& set) {
        const Interval& side = set.hull.sides[j];
        return optimum->side == bounds::Side::upper ? side.upper : side.lower;
      };
      const std::vector<RowRate> rates = moving.rates(*optimum);
      const OneSided found = bound_derivative(optima, *optimum, rates, rates);
      const double left = (value(now) - value(before)) / step, right = (value(after) - value(now)) / step;
      EXPECT_NEAR(found.left, left, tolerance * (1.0 + std::abs(left))) << "parameter " << j;
      EXPECT_NEAR(found.right, right, tolerance * (1.0 + std::abs(right))) << "parameter " << j;
    }
  }
}

TEST(HullDerivatives, EqualCentralDifferencesOfTheHull) {
  constexpr double kStep = 1e-6;
  int compared = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const std::size_t p = 2 + seed % 4;
    const Moving moving = random_set(seed, p, 12 * p);
    const HullOptima optima = moving.optima();
    const FeasibleSet before = moving.set(-kStep), after = moving.set(kStep);
    for (std::size_t j = 0; j < p; ++j) {
      for (const HullOptimum* optimum : {&optima.lower[j], &optima.upper[j]}) {
        ASSERT_TRUE(optimum->is_regular()) << why_not_regular(*optimum, "θ");
        const bool upper = optimum->side == bounds::Side::upper;
        const std::vector<RowRate> rates = moving.rates(*optimum);
        const OneSided found = bound_derivative(optima, *optimum, rates, rates);
        EXPECT_EQ(found.left, found.right);
        const Interval &low = before.hull.sides[j], &high = after.hull.sides[j];
        const double difference = (upper ? high.upper - low.upper : high.lower - low.lower) / (2.0 * kStep);
        EXPECT_NEAR(found.right, difference, 1e-7 * (1.0 + std::abs(difference))) << "seed " << seed;
        ++compared;
      }
    }
  }
  EXPECT_GE(compared, 200);
}

TEST(HullDerivatives, TheVertexSolvesItsEquationsAndTheMultipliersTheDual) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    const HullOptima optima = random_set(seed, 4, 60).optima();
    for (std::size_t j = 0; j < 4; ++j) {
      for (const HullOptimum* optimum : {&optima.lower[j], &optima.upper[j]}) {
        const double sign = optimum->side == bounds::Side::upper ? 1.0 : -1.0;
        Eigen::VectorXd rest = sign * Eigen::VectorXd::Unit(4, static_cast<Eigen::Index>(j));
        for (const bounds::WeightedRow& active : optimum->active) {
          EXPECT_NEAR(active.row.a.dot(optimum->at), active.row.b, 1e-13);
          rest -= active.multiplier * active.row.a;
        }
        EXPECT_LT(rest.norm(), 1e-13);
        EXPECT_NEAR(optimum->at[static_cast<Eigen::Index>(j)], optimum->value, 1e-13);
      }
    }
  }
}

// The multiplier is the derivative: of a row's own bound, and of a side of the prior.
TEST(HullDerivatives, AParameterThatNoRowBoundsFollowsItsPrior) {
  Moving moving(2, 1);
  moving.now.Y << 1.0, 0.0;
  moving.now.y << 2.0;
  moving.now.dy << 0.5;
  const HullOptima optima = moving.optima();
  ASSERT_TRUE(optima.upper[1].is_regular());
  ASSERT_EQ(optima.upper[1].active.size(), 1U);
  EXPECT_TRUE(optima.upper[1].active[0].row.origin.is_prior);
  EXPECT_DOUBLE_EQ(optima.upper[1].active[0].multiplier, 1.0);
  ASSERT_EQ(optima.lower[0].active.size(), 1U);
  EXPECT_FALSE(optima.lower[0].active[0].row.origin.is_prior);
  EXPECT_DOUBLE_EQ(optima.lower[0].active[0].multiplier, 1.0);
}

// Two rows say the same, and one of them moves: it alone can only tighten.
TEST(HullDerivatives, ADuplicateRowLeavesOneSideOnly) {
  Moving moving(1, 2);
  moving.now.Y << 1.0, 1.0;
  moving.now.y << 2.0, 2.0;
  moving.now.dy << 0.5, 0.5;
  moving.rate.dy << 1.0, 0.0;
  const HullOptima optima = moving.optima();
  EXPECT_FALSE(optima.upper[0].is_regular());
  EXPECT_NE(why_not_regular(optima.upper[0], "θ").find("2 constraints meet where 1 define"), std::string::npos);
  const std::vector<RowRate> upper = moving.rates(optima.upper[0]), lower = moving.rates(optima.lower[0]);
  const OneSided up = bound_derivative(optima, optima.upper[0], upper, upper);
  EXPECT_NEAR(up.left, 1.0, 1e-12);
  EXPECT_NEAR(up.right, 0.0, 1e-12);
  const OneSided down = bound_derivative(optima, optima.lower[0], lower, lower);
  EXPECT_NEAR(down.left, -1.0, 1e-12);
  EXPECT_NEAR(down.right, 0.0, 1e-12);
}

// More rows than parameters through the vertices of the hull: both one-sided derivatives, not one of many multipliers.
TEST(HullDerivatives, RowsThatMeetInAVertexGiveTheOneSidedDifferences) {
  int kinks = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const std::size_t p = 2 + seed % 3;
    Moving moving = random_set(seed, p, 10 * p);
    const HullOptima regular = moving.optima();
    // Through each vertex two more rows, between those that are there.
    std::vector<Eigen::VectorXd> normals;
    std::vector<double> offsets;
    Random random(100 + seed);
    for (std::size_t j = 0; j < p; ++j) {
      for (const HullOptimum* optimum : {&regular.lower[j], &regular.upper[j]}) {
        for (int extra = 0; extra < 2; ++extra) {
          Eigen::VectorXd normal = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(p));
          for (const bounds::WeightedRow& active : optimum->active) {
            normal += random.unit() * active.row.a;
          }
          normals.push_back(normal);
          offsets.push_back(normal.dot(optimum->at));
        }
      }
    }
    const RegressionBlock now = moving.now, rate = moving.rate;
    const auto old = static_cast<Eigen::Index>(now.t.size()), added = static_cast<Eigen::Index>(normals.size());
    moving.resize(static_cast<std::size_t>(old + added), p);
    const auto keep = [old](RegressionBlock& to, const RegressionBlock& from) {
      to.Y.topRows(old) = from.Y;
      to.dY.topRows(old) = from.dY;
      to.y.head(old) = from.y;
      to.dy.head(old) = from.dy;
    };
    keep(moving.now, now);
    keep(moving.rate, rate);
    for (Eigen::Index k = 0; k < added; ++k) {
      // Far enough away on its other side.
      moving.now.Y.row(old + k) = normals[static_cast<std::size_t>(k)].transpose();
      moving.now.dy[old + k] = 50.0;
      moving.now.y[old + k] = offsets[static_cast<std::size_t>(k)] - 50.0;
      moving.rate.Y.row(old + k) = random.matrix(1, static_cast<Eigen::Index>(p));
      moving.rate.y[old + k] = random.symmetric();
    }
    const HullOptima optima = moving.optima();
    for (std::size_t j = 0; j < p; ++j) {
      for (const HullOptimum* optimum : {&optima.lower[j], &optima.upper[j]}) {
        EXPECT_EQ(optimum->active.size(), p + 2) << "seed " << seed;
        EXPECT_FALSE(optimum->is_regular());
        const std::vector<RowRate> rates = moving.rates(*optimum);
        const OneSided found = bound_derivative(optima, *optimum, rates, rates);
        kinks += std::abs(found.left - found.right) > 1e-3 ? 1 : 0;
      }
    }
    expect_sides(moving, optima, 1e-6, 1e-4);
  }
  EXPECT_GE(kinks, 40);
}

// max θ_1 on the facet θ_1 + s θ_2 <= 1, 0.5 <= θ_2 <= 2: the bound is 1 − 0.5 s to the right and 1 − 2 s to the left.
TEST(HullDerivatives, AFacetParallelToTheObjectiveTurnsAboutItsEnds) {
  Moving moving(2, 3);
  moving.now.Y << 1.0, 0.0, 0.0, 1.0, 1.0, 1.0;  // the last couples the two, but not where it touches nothing
  moving.now.y << 0.0, 1.25, 0.0;
  moving.now.dy << 1.0, 0.75, 3.5;
  moving.rate.Y << 0.0, 1.0, 0.0, 0.0, 0.0, 0.0;
  const auto expect = [&](bool one_block) {
    const HullOptima optima = moving.optima();
    ASSERT_EQ(optima.set.blocks().size() == 1, one_block);
    EXPECT_EQ(optima.upper[0].unique_maximiser, !one_block);
    EXPECT_EQ(why_not_regular(optima.upper[0], "θ").empty(), !one_block);
    const std::vector<RowRate> rates = moving.rates(optima.upper[0]);
    const OneSided found = bound_derivative(optima, optima.upper[0], rates, rates);
    EXPECT_NEAR(found.left, -2.0, 1e-9);
    EXPECT_NEAR(found.right, -0.5, 1e-9);
  };
  expect(false);
  moving.now.y[2] = 4.1;  // θ_1 + θ_2 >= 0.6 cuts a corner off
  expect(true);
}

TEST(HullDerivatives, ParallelFacetsOfRandomSetsGiveTheOneSidedDifferences) {
  int kinks = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const std::size_t p = 2 + seed % 3;
    Moving moving = random_set(seed, p, 8 * p);
    // A row that halves the way from the middle to the upper bound of each parameter.
    const FeasibleSet set = moving.set(0.0);
    const std::vector<double>& centre = set.polytope->chebyshev_centre();
    for (std::size_t j = 0; j < p; ++j) {
      const auto k = static_cast<Eigen::Index>(j);
      moving.now.Y.row(k) = Eigen::RowVectorXd::Unit(static_cast<Eigen::Index>(p), k);
      moving.now.dY.row(k).setZero();
      moving.now.dy[k] = 5.0;
      moving.now.y[k] = 0.5 * (centre[j] + set.hull.sides[j].upper) - 5.0;
    }
    const HullOptima optima = moving.optima();
    for (std::size_t j = 0; j < p; ++j) {
      EXPECT_FALSE(optima.upper[j].unique_maximiser);
      const std::vector<RowRate> rates = moving.rates(optima.upper[j]);
      const OneSided found = bound_derivative(optima, optima.upper[j], rates, rates);
      EXPECT_LE(found.left, found.right + 1e-9);
      kinks += found.right - found.left > 1e-3 ? 1 : 0;
    }
    expect_sides(moving, optima, 1e-6, 1e-4);
  }
  EXPECT_GE(kinks, 20);
}

}  // namespace
}  // namespace wheelwright::study::hull_derivatives_test

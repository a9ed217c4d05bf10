// SPDX-License-Identifier: Apache-2.0
// The feasible set of simulated rows: what it must contain, and what it must not depend on.
#include <limits>

#include <gtest/gtest.h>

#include "bounds/feasible_set.hpp"
#include "bounds/minimax.hpp"
#include "tests/bounds/exact.hpp"
#include "tests/bounds/rows.hpp"

namespace wheelwright::bounds::feasible_set_test {

using core::RegressionTable;

namespace {

using testing_rows::BlockSource;
using testing_rows::Random;
using testing_rows::Rows;

/// Rows y = Y°θ + e, Y within dY of Y°, with e = ±noise and Y − Y° = ±dY in every second row, and less in the others.
/// Bounds are the declared ones, or what rounding makes of them: never more than what is there in every second row.
Rows simulate(std::uint64_t seed, const std::vector<double>& theta, std::size_t count, double noise, double dY) {
  Random random(seed);
  const std::size_t p = theta.size();
  Rows rows(p);
  for (std::size_t k = 0; k < count; ++k) {
    std::vector<double> Y = random.vector(p), measured(p);
    const auto error = [&](double bound) {
      const double e = bound * random.symmetric();
      return k % 2 == 0 ? std::copysign(bound, e) : e;
    };
    std::vector<double> bounds(p);
    double y = error(noise);
    for (std::size_t j = 0; j < p; ++j) {
      y += Y[j] * theta[j];
      measured[j] = Y[j] + error(dY);
      bounds[j] = exact::rounded_up(abs(exact::rational(measured[j]) - exact::rational(Y[j])));
      bounds[j] = k % 2 == 0 ? bounds[j] : std::max(bounds[j], dY);
    }
    const double is = exact::noise_of(Y, theta, y);
    rows.add(measured, y, k % 2 == 0 ? is : std::max(is, noise), bounds);
  }
  return rows;
}

TEST(FeasibleSet, holds_the_truth_in_1000_of_1000_runs) {
  std::size_t held = 0;
  for (std::uint64_t seed = 0; seed < 1000; ++seed) {
    Random random(seed);
    const std::size_t p = 1 + seed % 4;
    std::vector<double> theta(p);
    for (double& x : theta) {
      x = 5.0 * random.unit();
    }
    const Rows rows = simulate(seed, theta, 60, 0.1, seed % 2 == 0 ? 0.0 : 0.02);
    RegressionTable table = rows.table();
    Box prior = testing_rows::cube(p, 20.0);
    for (Interval& side : prior.sides) {
      side.lower = 0.0;
    }
    const FeasibleSet set = feasible_set(table, prior);
    held += set.status == FeasibleSet::Status::nonempty && exact::satisfies(set.polytope->facets(), theta) &&
            set.hull.contains(theta);
  }
  EXPECT_EQ(held, 1000U);
}

TEST(FeasibleSet, holds_the_truth_where_signs_are_open) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    const std::size_t p = 1 + seed % 3;
    Random random(seed);
    std::vector<double> theta = random.vector(p);
    theta[0] *= 0.02;  // the data leave this sign open
    const Rows rows = simulate(seed, theta, 80, 0.1, 0.02);
    RegressionTable table = rows.table();
    const FeasibleSet set = feasible_set(table, testing_rows::cube(p, 20.0));
    ASSERT_EQ(set.status, FeasibleSet::Status::nonempty);
    EXPECT_TRUE(exact::satisfies(set.polytope->facets(), theta)) << seed;
    EXPECT_TRUE(set.hull.contains(theta)) << seed;
  }
}

// {|θ − 1| <= 0.5 + |θ|/2}: θ >= 0 gives [1/3, 3], θ <= 0 gives nothing but 1 − θ <= 0.5 − θ/2, never. And with y =
// 0.1: |θ − 0.1| <= 0.5 + |θ|/2 is [−0.8, 1.2], a union of two signs.
TEST(FeasibleSet, errors_in_variables_in_closed_form) {
  const auto hull_of = [](double y) {
    Rows rows(1);
    rows.add({1.0}, y, 0.5, {0.5});
    RegressionTable table = rows.table();
    return feasible_set(table, testing_rows::cube(1, 10.0));
  };
  const FeasibleSet one_sign = hull_of(1.0);
  EXPECT_NEAR(one_sign.hull.sides[0].lower, 1.0 / 3.0, 1e-12);
  EXPECT_NEAR(one_sign.hull.sides[0].upper, 3.0, 1e-12);
  const FeasibleSet both = hull_of(0.1);
  EXPECT_NEAR(both.hull.sides[0].lower, -0.8, 1e-12);
  EXPECT_NEAR(both.hull.sides[0].upper, 1.2, 1e-12);
  EXPECT_EQ(both.sign_parts, 2U);
  EXPECT_TRUE(both.convexified);
}

TEST(FeasibleSet, does_not_depend_on_the_blocks_of_the_source) {
  const Rows rows = simulate(3, {1.0, -2.0, 0.5}, 3000, 0.1, 0.0);
  const Box prior = testing_rows::cube(3, 100.0);
  RegressionTable table = rows.table();
  const FeasibleSet whole = feasible_set(table, prior);
  for (const std::size_t size : {1U, 7U, 1000U}) {
    BlockSource source(rows, size);
    const FeasibleSet set = feasible_set(source, prior);
    EXPECT_EQ(set.hull, whole.hull) << size;
    EXPECT_EQ(set.polytope->facets().size(), whole.polytope->facets().size());
    EXPECT_EQ(set.passes, 2U);
  }
}

TEST(FeasibleSet, finds_independent_blocks_and_names_what_binds) {
  Random random(5);
  Rows rows(4, 2);
  const std::vector<double> theta{1.0, 2.0, 3.0, 4.0};
  for (int k = 0; k < 500; ++k) {
    const std::vector<double> u = random.vector(4);
    rows.add({u[0], 0.0, u[1], 0.0}, u[0] * theta[0] + u[1] * theta[2] + 0.1 * random.symmetric(), 0.11);
    rows.add({0.0, u[2], 0.0, u[3]}, u[2] * theta[1] + u[3] * theta[3] + 0.1 * random.symmetric(), 0.11);
  }
  RegressionTable table = rows.table();
  const FeasibleSet set = feasible_set(table, testing_rows::cube(4, 100.0));
  ASSERT_EQ(set.polytope->blocks().size(), 2U);
  EXPECT_EQ(set.polytope->blocks()[0].parameters, (std::vector<std::size_t>{0, 2}));
  EXPECT_TRUE(set.polytope->has_vertices());
  for (std::size_t j = 0; j < 4; ++j) {
    EXPECT_LE(set.upper[j].binding.size(), 2U);
    // Only the binding rows: the same bound.
    std::vector<HalfSpace> few;
    for (const WeightedRow& weighted : set.upper[j].binding) {
      EXPECT_EQ(weighted.row.origin.output, j % 2);
      few.push_back(weighted.row);
    }
    const Polytope only(few, testing_rows::cube(4, 100.0));
    EXPECT_NEAR(only.hull().sides[j].upper, set.hull.sides[j].upper, 1e-9);
  }
}

TEST(FeasibleSet, rejects_bad_arguments) {
  const Rows rows = simulate(3, {1.0}, 10, 0.1, 0.0);
  RegressionTable table = rows.table();
  EXPECT_THROW((void)feasible_set(table, testing_rows::cube(2, 1.0)), InvalidArgument);
  Box unbounded = testing_rows::cube(1, 1.0);
  unbounded.sides[0].upper = std::numeric_limits<double>::infinity();
  EXPECT_THROW((void)feasible_set(table, unbounded), InvalidArgument);
}

TEST(Minimax, bound_is_where_the_set_becomes_empty) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    const std::size_t p = 1 + seed % 4;
    Random random(seed);
    const std::vector<double> theta = random.vector(p);
    const Rows noisy = simulate(seed, theta, 400, 0.1, 0.0);
    const auto with_bound = [&](double bound) {
      RegressionBlock block = noisy.block(0, noisy.instants());
      block.dy.setConstant(bound);
      return block;
    };
    RegressionTable bare(with_bound(0.0));
    const MinimaxFit fit = minimax_fit(bare, testing_rows::cube(p, 50.0));
    EXPECT_TRUE(fit.converged) << seed;
    EXPECT_LE(fit.lower, fit.upper);
    EXPECT_LE(fit.upper - fit.lower, 1e-9 * fit.upper);
    EXPECT_LE(fit.active.size(), p + 1);
    RegressionTable above(with_bound(fit.upper * (1.0 + 1e-6))), below(with_bound(fit.lower * (1.0 - 1e-6)));
    EXPECT_EQ(feasible_set(above, testing_rows::cube(p, 50.0)).status, FeasibleSet::Status::nonempty);
    const FeasibleSet empty = feasible_set(below, testing_rows::cube(p, 50.0));
    EXPECT_EQ(empty.status, FeasibleSet::Status::empty);
    EXPECT_TRUE(exact::contradict(empty.contradiction, testing_rows::cube(p, 50.0)));
  }
}

// A vertex of columns that are nearly one is as near as rounding lets it come: rows that it still violates are not
// asked for without end.
TEST(Minimax, EndsOnColumnsThatAreNearlyOne) {
  for (const double apart : {1e-6, 1e-9, 1e-12}) {
    for (const double noise : {0.0, 0.3}) {
      for (std::uint64_t seed = 0; seed < 6; ++seed) {
        Random random(seed);
        const Rows drawn = simulate(seed, random.vector(4), 600, 0.1, 0.0);
        RegressionBlock block = drawn.block(0, drawn.instants());
        block.Y.col(1) = block.Y.col(0) + apart * block.Y.col(1);
        block.Y.col(3) = block.Y.col(2) - apart * block.Y.col(3);
        block.dY.setConstant(noise);
        block.dy.setZero();
        RegressionTable table(block);
        const MinimaxFit fit = minimax_fit(table, testing_rows::cube(4, 50.0));
        EXPECT_LE(fit.lower, fit.upper);
        EXPECT_LE(fit.upper - fit.lower, 1e-3 * fit.upper) << apart << ", " << noise << ", seed " << seed;
      }
    }
  }
}

TEST(Minimax, weights_and_declared_bounds_are_units_of_the_answer) {
  const Rows rows = simulate(4, {1.0, 2.0}, 300, 0.1, 0.0);
  RegressionBlock block = rows.block(0, rows.instants());
  block.dy.setZero();
  RegressionTable bare(block);
  block.dy.setConstant(0.03);
  RegressionTable declared(block);
  const Box prior = testing_rows::cube(2, 50.0);
  const MinimaxFit one = minimax_fit(bare, prior);
  MinimaxOptions options;
  options.weights = {4.0};
  EXPECT_NEAR(minimax_fit(bare, prior, options).upper, one.upper / 4.0, 1e-10);
  EXPECT_NEAR(minimax_fit(declared, prior).upper, one.upper - 0.03, 1e-10);
  block.dy.setConstant(0.2);
  RegressionTable enough(block);
  EXPECT_EQ(minimax_fit(enough, prior).upper, 0.0);
  options.weights = {-1.0};
  EXPECT_THROW((void)minimax_fit(bare, prior, options), InvalidArgument);
}

TEST(Outliers, fewest_are_dropped_and_the_truth_is_kept) {
  const std::vector<double> theta{1.0, -2.0};
  const Rows clean = simulate(9, theta, 200, 0.1, 0.0);
  RegressionBlock block = clean.block(0, clean.instants());
  const std::vector<std::size_t> wrong{17, 60, 140};
  for (const std::size_t k : wrong) {
    block.y[static_cast<Eigen::Index>(k)] += k == 60 ? -5.0 : 5.0;
  }
  RegressionTable table(block);
  const Box prior = testing_rows::cube(2, 50.0);
  OutlierOptions options;
  options.most = 2;
  const OutlierResult too_few = feasible_set_with_outliers(table, prior, options);
  EXPECT_EQ(too_few.set.status, FeasibleSet::Status::empty);
  EXPECT_TRUE(too_few.minimal);
  options.most = 4;
  const OutlierResult result = feasible_set_with_outliers(table, prior, options);
  ASSERT_EQ(result.set.status, FeasibleSet::Status::nonempty);
  EXPECT_EQ(result.dropped, wrong);
  EXPECT_TRUE(result.minimal);
  EXPECT_TRUE(result.set.polytope->contains(theta));
  options.budget = 3;
  const OutlierResult heuristic = feasible_set_with_outliers(table, prior, options);
  EXPECT_FALSE(heuristic.minimal);
  EXPECT_EQ(heuristic.dropped, wrong);
}

}  // namespace
}  // namespace wheelwright::bounds::feasible_set_test

// SPDX-License-Identifier: Apache-2.0
// The interval hull alone and the minimax fit of rows in memory, against the feasible set and closed forms.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "bounds/certificate.hpp"
#include "bounds/feasible_set.hpp"
#include "bounds/interval_hull.hpp"
#include "bounds/minimax.hpp"
#include "core/error.hpp"
#include "tests/bounds/rows.hpp"

namespace wheelwright::bounds::interval_hull_test {
namespace {

using testing_rows::BlockSource;
using testing_rows::cube;
using testing_rows::Random;
using testing_rows::Rows;

/// Rows in memory, by columns.
struct Columns {
  std::vector<std::vector<double>> Y, dY;
  std::vector<double> y, dy;
  SlabColumns view;

  explicit Columns(const RegressionBlock& block) {
    const auto n = static_cast<std::size_t>(block.rows());
    y.assign(block.y.data(), block.y.data() + n);
    dy.assign(block.dy.data(), block.dy.data() + n);
    const bool noisy = !block.dY.isZero(0.0);
    for (Eigen::Index j = 0; j < block.Y.cols(); ++j) {
      Y.emplace_back();
      dY.emplace_back();
      for (Eigen::Index i = 0; i < block.rows(); ++i) {
        Y.back().push_back(block.Y(i, j));
        dY.back().push_back(block.dY(i, j));
      }
    }
    for (std::size_t j = 0; j < Y.size(); ++j) {
      view.Y.push_back(Y[j].data());
      if (noisy) {
        view.dY.push_back(dY[j].data());
      }
    }
    view.n = n;
    view.y = y.data();
    view.dy = dy.data();
  }
};

/// Slowly turning rows of θ = (1, 2, …)/p with noise in bounds, on Y too where `noisy`.
Rows slow_rows(std::uint64_t seed, std::size_t p, std::size_t n, bool noisy, double bound = 0.11) {
  Random random(seed);
  Rows rows(p);
  for (std::size_t k = 0; k < n; ++k) {
    std::vector<double> Y(p), dY(p, 0.0);
    double y = 0.1 * random.symmetric();
    for (std::size_t j = 0; j < p; ++j) {
      Y[j] = std::sin(0.002 * static_cast<double>((k + 100) * (j + 1))) + 0.2 * random.symmetric();
      y += Y[j] * static_cast<double>(j + 1) / static_cast<double>(p);
      if (noisy) {
        dY[j] = 0.01;
        Y[j] += 0.01 * random.symmetric();
      }
    }
    rows.add(Y, y, bound, dY);
  }
  return rows;
}

Box positive(std::size_t p) {
  Box box;
  box.sides.assign(p, {0.0, 100.0});
  return box;
}

TEST(IntervalHull, IsThatOfTheFeasibleSetInMemoryAndFromASource) {
  for (const bool noisy : {false, true}) {
    for (const std::size_t p : {1, 3, 6}) {
      const Rows rows = slow_rows(p, p, 30000, noisy);
      core::RegressionTable table = rows.table();
      const FeasibleSet set = feasible_set(table, positive(p));
      const Columns columns(table.block());
      const IntervalHull memory = interval_hull(columns.view, positive(p)), source = interval_hull(table, positive(p));
      ASSERT_FALSE(memory.empty || source.empty);
      EXPECT_EQ(memory.passes, 1u);
      EXPECT_EQ(source.passes, 2u);
      for (std::size_t j = 0; j < p; ++j) {
        const Interval& exact = set.hull.sides[j];
        for (const IntervalHull* hull : {&memory, &source}) {
          EXPECT_NEAR(hull->hull.sides[j].lower, exact.lower, 1e-9 * exact.width()) << p << ' ' << j;
          EXPECT_NEAR(hull->hull.sides[j].upper, exact.upper, 1e-9 * exact.width()) << p << ' ' << j;
          EXPECT_LE(hull->upper[j].binding.size(), p + 1);
        }
      }
    }
  }
}

TEST(IntervalHull, DoesNotDependOnThreadsOrBlocks) {
  const Rows rows = slow_rows(5, 4, 150000, false);
  core::RegressionTable table = rows.table();
  const Columns columns(table.block());
  IntervalHullOptions two;
  two.threads = 2;
  EXPECT_EQ(interval_hull(columns.view, positive(4)).hull, interval_hull(columns.view, positive(4), two).hull);
  BlockSource small(rows, 100), large(rows, 9000);
  EXPECT_EQ(interval_hull(small, positive(4)).hull, interval_hull(large, positive(4)).hull);
}

// With little room for rows that matter, more passes give the same hull.
TEST(IntervalHull, TakesMorePassesWhereThereIsLittleRoom) {
  const Rows rows = slow_rows(6, 4, 300000, false, 0.2);
  BlockSource source(rows, 5000);
  IntervalHullOptions little;
  little.most_rows = 64;
  const IntervalHull tight = interval_hull(source, positive(4)), same = interval_hull(source, positive(4), little);
  EXPECT_GT(same.passes, tight.passes);
  for (std::size_t j = 0; j < 4; ++j) {
    EXPECT_NEAR(same.hull.sides[j].lower, tight.hull.sides[j].lower, 1e-9 * tight.hull.sides[j].width());
    EXPECT_NEAR(same.hull.sides[j].upper, tight.hull.sides[j].upper, 1e-9 * tight.hull.sides[j].width());
  }
}

// Rows that look settled by what came early: a corner that each portion moves, and a row beyond it at the very
// beginning.
TEST(IntervalHull, RowsOfTheBeginningAreHeldAgainstTheCornersOfTheEnd) {
  for (const bool noisy : {false, true}) {
    for (const std::uint64_t seed : {1, 2, 3}) {
      Random random(seed);
      const std::size_t n = 200000, p = 3;
      Rows rows(p);
      for (std::size_t k = 0; k < n; ++k) {
        // Late rows are the narrow ones, so that the hull shrinks to the end, and turn slowly.
        const double width = 1.0 + 50.0 * (1.0 - static_cast<double>(k) / n), angle = 1e-5 * static_cast<double>(k);
        std::vector<double> Y{std::cos(angle), std::sin(angle), 0.3 * random.symmetric()}, dY(p, noisy ? 0.01 : 0.0);
        rows.add(Y, Y[0] + 2.0 * Y[1] + 3.0 * Y[2] + 0.99 * width * random.symmetric(), width, dY);
      }
      core::RegressionTable table = rows.table();
      const Columns columns(table.block());
      const IntervalHull memory = interval_hull(columns.view, positive(p)), source = interval_hull(table, positive(p));
      ASSERT_FALSE(memory.empty || source.empty);
      for (std::size_t j = 0; j < p; ++j) {
        const Interval &exact = source.hull.sides[j], &found = memory.hull.sides[j];
        EXPECT_NEAR(found.lower, exact.lower, 1e-9 * exact.width()) << seed << ' ' << j;
        EXPECT_NEAR(found.upper, exact.upper, 1e-9 * exact.width()) << seed << ' ' << j;
      }
    }
  }
}

TEST(IntervalHull, AContradictionIsProvedAndNumbersThatAreNoneAreRefused) {
  const Rows rows = slow_rows(7, 3, 20000, false);
  Columns columns(rows.block(0, 20000));
  columns.y[12345] += 5.0;
  const IntervalHull empty = interval_hull(columns.view, positive(3));
  ASSERT_TRUE(empty.empty);
  EXPECT_EQ(empty.hull, positive(3));
  EXPECT_TRUE(proves_empty(empty.contradiction, positive(3)));
  bool named = false;
  for (const WeightedRow& row : empty.contradiction) {
    named = named || row.row.origin.sample == 12345;
  }
  EXPECT_TRUE(named);
  columns.y[12345] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(static_cast<void>(interval_hull(columns.view, positive(3))), InvalidArgument);
  EXPECT_THROW(static_cast<void>(interval_hull(columns.view, positive(2))), InvalidArgument);
}

// Chebyshev's fits of x² by lines on {−1, 0, 1} and of x³ by quadratics on {±1, ±1/2}, and a long log.
TEST(MinimaxInMemory, ClosedFormsAndTheSource) {
  Rows square(2), cubic(3);
  for (const double x : {-1.0, 0.0, 1.0}) {
    square.add({1.0, x}, x * x, 0.0);
  }
  for (const double x : {-1.0, -0.5, 0.5, 1.0}) {
    cubic.add({1.0, x, x * x}, x * x * x, 0.0);
  }
  const MinimaxFit half = minimax_fit(Columns(square.block(0, 3)).view, cube(2, 100.0));
  EXPECT_LE(half.lower, 0.5);
  EXPECT_GE(half.upper, 0.5);
  EXPECT_LE(half.upper - half.lower, 1e-12);
  const MinimaxFit quarter = minimax_fit(Columns(cubic.block(0, 4)).view, cube(3, 100.0));
  EXPECT_LE(quarter.lower, 0.25);
  EXPECT_GE(quarter.upper, 0.25);
  EXPECT_LE(quarter.upper - quarter.lower, 1e-12);

  for (const bool noisy : {false, true}) {
    Rows rows = slow_rows(8, 4, 40000, noisy);
    RegressionBlock block = rows.block(0, 40000);
    block.dy.setZero();
    core::RegressionTable table(block);
    const MinimaxFit source = minimax_fit(table, positive(4)), memory = minimax_fit(Columns(block).view, positive(4));
    EXPECT_TRUE(source.converged && memory.converged);
    EXPECT_LE(std::max(source.lower, memory.lower), std::min(source.upper, memory.upper));
    EXPECT_NEAR(source.upper, memory.upper, 1e-8 * source.upper);
  }
}

// Looks at early rows are taken with small boxes around fits that know nothing of what comes.
TEST(MinimaxInMemory, RowsThatDecideComeLateOrSeldom) {
  constexpr std::size_t n = 100000;
  for (const bool noisy : {false, true}) {
    for (const std::size_t at : {std::size_t{3}, std::size_t{20001}, n / 2, n - 2, n}) {
      Rows rows = slow_rows(9, 4, n, noisy);
      RegressionBlock block = rows.block(0, n);
      block.dy.setZero();
      for (Eigen::Index i = 0; i < block.y.size(); ++i) {
        const auto row = static_cast<std::size_t>(i);
        if (at == n ? row > n - n / 10 : row == at) {
          block.y[i] += at == n ? 5.0 * block.Y(i, 1) : 30.0;  // another robot at the end, or one row far off
        }
      }
      core::RegressionTable table(block);
      const MinimaxFit source = minimax_fit(table, positive(4)), memory = minimax_fit(Columns(block).view, positive(4));
      ASSERT_TRUE(source.converged && memory.converged) << at;
      EXPECT_LE(std::max(source.lower, memory.lower), std::min(source.upper, memory.upper)) << at;
      double asked = 0.0;
      for (Eigen::Index i = 0; i < block.y.size(); ++i) {
        double left = block.y[i], allowed = 0.0;
        for (Eigen::Index j = 0; j < 4; ++j) {
          left -= block.Y(i, j) * memory.theta[static_cast<std::size_t>(j)];
          allowed += block.dY(i, j) * std::abs(memory.theta[static_cast<std::size_t>(j)]);
        }
        asked = std::max(asked, std::abs(left) - allowed);
      }
      EXPECT_LE(asked, memory.upper * (1.0 + 1e-12)) << at;
      EXPECT_GE(asked, memory.upper * (1.0 - 1e-6)) << at;
    }
  }
}

TEST(MinimaxInMemory, HoldsWhateverThePassesThatAreAllowed) {
  Rows rows = slow_rows(10, 4, 60000, false);
  RegressionBlock block = rows.block(0, 60000);
  block.dy.setZero();
  block.y[59990] += 40.0;
  const Columns columns(block);
  const MinimaxFit full = minimax_fit(columns.view, positive(4));
  MinimaxOptions options;
  options.pass_limit = 1;
  const MinimaxFit one = minimax_fit(columns.view, positive(4), options);
  EXPECT_LE(one.lower, full.upper);
  EXPECT_GE(one.upper, full.lower);
}

}  // namespace
}  // namespace wheelwright::bounds::interval_hull_test

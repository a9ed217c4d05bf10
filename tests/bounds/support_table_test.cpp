// SPDX-License-Identifier: Apache-2.0
// The table of all vertices: never below the exact support, equal to it where the budget lasts, sublinear,
// within its budget.
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "bounds/support_table.hpp"
#include "core/error.hpp"
#include "tests/bounds/exact.hpp"
#include "tests/bounds/rows.hpp"

namespace wheelwright::bounds::support_table_test {
namespace {

using exact::rational;
using testing_rows::cube;
using testing_rows::Random;

/// Half-spaces around the origin; quantised: many of them meet in one vertex.
std::vector<HalfSpace> half_spaces(std::uint64_t seed, std::size_t p, std::size_t count, bool quantised) {
  Random random(seed);
  std::vector<HalfSpace> rows;
  for (std::size_t r = 0; r < count; ++r) {
    std::vector<double> a = random.vector(p);
    double b = 0.3 + random.unit();
    if (quantised) {
      for (double& x : a) {
        x = std::round(2.0 * x);
      }
      b = 1.0;
    }
    rows.push_back({Eigen::Map<const Eigen::VectorXd>(a.data(), static_cast<Eigen::Index>(p)), b, {}});
  }
  return rows;
}

/// The same for two groups of parameters that no row couples, and a parameter in no row.
std::vector<HalfSpace> coupled_in_pairs(std::uint64_t seed, std::size_t count) {
  std::vector<HalfSpace> rows;
  for (const Eigen::Index first : {0, 2}) {
    for (const HalfSpace& row : half_spaces(seed + static_cast<std::uint64_t>(first), 2, count, false)) {
      rows.push_back({Eigen::VectorXd::Zero(5), row.b, {}});
      rows.back().a.segment<2>(first) = row.a;
    }
  }
  return rows;
}

/// Slowly turning directions.
std::vector<double> direction(std::size_t k, std::size_t p) {
  std::vector<double> a(p);
  for (std::size_t j = 0; j < p; ++j) {
    a[j] = std::sin(0.003 * static_cast<double>(k * (j + 1)) + static_cast<double>(j));
  }
  return a;
}

std::vector<double> negative(std::vector<double> a) {
  for (double& x : a) {
    x = -x;
  }
  return a;
}

SupportTable table_of(const Polytope& set, std::size_t budget = 64) {
  auto table = SupportTable::make(set, {.slots = 2, .budget = budget});
  EXPECT_TRUE(table.has_value());
  return table.value();
}

void expect_exact_support(const std::vector<HalfSpace>& rows, std::size_t p, std::size_t directions) {
  const Polytope set(rows, cube(p, 4.0));
  const auto vertices = exact::vertices(exact::rows_of(rows, cube(p, 4.0)), p);
  ASSERT_FALSE(vertices.empty());
  for (const std::size_t budget : {0, 1, 64}) {
    SupportTable table = table_of(set, budget);
    for (std::size_t k = 0; k < directions; ++k) {
      const std::vector<double> a = direction(7 * k, p);
      const exact::Rational bound = rational(table.support(a, k % 2));
      std::vector<exact::Rational> exactly;
      for (const double x : a) {
        exactly.push_back(rational(x));
      }
      for (const auto& vertex : vertices) {
        ASSERT_TRUE(exact::dot(exactly, vertex) <= bound) << p << ' ' << k << ' ' << budget;
      }
    }
  }
}

TEST(SupportTable, IsNeverBelowTheExactSupportWhateverTheBudget) {
  for (const bool quantised : {false, true}) {
    for (std::size_t p = 1; p <= 3; ++p) {
      expect_exact_support(half_spaces(p, p, 12, quantised), p, 200);
    }
  }
  expect_exact_support(coupled_in_pairs(7, 5), 5, 100);
}

TEST(SupportTable, IsTheSupportOfTheLinearProgram) {
  for (const bool quantised : {false, true}) {
    for (const std::size_t p : {1, 2, 4, 5}) {
      const Polytope set(half_spaces(10 + p, p, 30, quantised), cube(p, 4.0));
      SupportTable table = table_of(set);
      for (std::size_t k = 0; k < 300; ++k) {
        const std::vector<double> a = direction(k, p), opposite = negative(a);
        const double above = table.support(a, 0), below = table.support(opposite, 1);
        const double expected = set.support(a), otherwise = set.support(opposite), width = expected + otherwise;
        EXPECT_NEAR(above, expected, 1e-9 * width) << p << ' ' << k;
        EXPECT_NEAR(below, otherwise, 1e-9 * width) << p << ' ' << k;
      }
      EXPECT_LT(table.edges(), 3u * 600u);
    }
  }
}

TEST(SupportTable, IsNoLooserThanTheWalk) {
  const Polytope set(half_spaces(3, 4, 40, false), cube(4, 4.0));
  SupportTable table = table_of(set);
  SupportWalk walk(set, {.few = 0});
  for (std::size_t k = 0; k < 500; ++k) {
    const std::vector<double> a = direction(3 * k, 4);
    const double width = set.support(a) + set.support(negative(a));
    EXPECT_NEAR(table.support(a, k % 2), walk.support(a, k % 2), 1e-12 * width);
  }
}

// h(x + y) <= h(x) + h(y) and h(s x) = s h(x): what a table with an edge to a wrong vertex would break.
TEST(SupportTable, IsSublinearAndHomogeneous) {
  const Polytope set(half_spaces(5, 5, 40, false), cube(5, 4.0));
  SupportTable table = table_of(set);
  Random random(6);
  for (std::size_t k = 0; k < 300; ++k) {
    const std::vector<double> x = random.vector(5), y = random.vector(5);
    std::vector<double> both(5), scaled(5);
    for (std::size_t j = 0; j < 5; ++j) {
      both[j] = x[j] + y[j];
      scaled[j] = 1024.0 * x[j];
    }
    const double of_x = table.support(x), of_y = table.support(y);
    EXPECT_LE(table.support(both), (of_x + of_y) + 1e-11 * (std::abs(of_x) + std::abs(of_y)));
    EXPECT_NEAR(table.support(scaled), 1024.0 * of_x, 1024.0 * 1e-11 * (1.0 + std::abs(of_x)));
  }
}

// A slot remembers where its last direction ended, and nothing else of it: any order of directions gives the same h.
TEST(SupportTable, DoesNotDependOnWhatWasAskedBefore) {
  const Polytope set(half_spaces(8, 4, 40, false), cube(4, 4.0));
  SupportTable forwards = table_of(set), backwards = table_of(set);
  std::vector<double> answers;
  for (std::size_t k = 0; k < 300; ++k) {
    answers.push_back(forwards.support(direction(40 * k, 4)));
  }
  for (std::size_t k = 300; k-- > 0;) {
    EXPECT_NEAR(backwards.support(direction(40 * k, 4)), answers[k], 1e-11 * (1.0 + std::abs(answers[k])));
  }
}

TEST(SupportTable, CopiesShareTheirVerticesAndNothingElse) {
  const Polytope set(half_spaces(8, 4, 40, false), cube(4, 4.0));
  auto first = std::make_unique<SupportTable>(table_of(set));
  SupportTable second = *first, alone = table_of(set);
  EXPECT_EQ(&first->graphs(), &second.graphs());
  for (std::size_t k = 0; k < 300; ++k) {
    static_cast<void>(first->support(direction(7 * k + 3, 4)));
    const double expected = alone.support(direction(40 * k, 4));
    EXPECT_EQ(second.support(direction(40 * k, 4)), expected);
  }
  first.reset();
  EXPECT_EQ(second.support(direction(1, 4)), alone.support(direction(1, 4)));
}

TEST(SupportTable, KeepsItsBudgetAndIsThenNoWorseThanTheHull) {
  const Polytope set(half_spaces(5, 5, 40, false), cube(5, 4.0));
  SupportTable none = table_of(set, 0), one = table_of(set, 1), full = table_of(set);
  std::size_t looser = 0, better_than_hull = 0;
  for (std::size_t k = 0; k < 200; ++k) {
    const std::vector<double> a = direction(90 * k, 5);
    const double best = full.support(a), cut = none.support(a), hull = set.hull().support(a);
    EXPECT_LE(cut, hull);
    std::vector<double> at(5);
    static_cast<void>(set.support(a, at));
    const exact::Rational reached = exact::dot(a, exact::pulled_inside(set.facets(), at, set.centre()));
    EXPECT_TRUE(reached <= rational(cut));
    EXPECT_TRUE(reached <= rational(best));
    looser += cut > best + 1e-6 ? 1 : 0;
    better_than_hull += cut < hull ? 1 : 0;
    static_cast<void>(one.support(a));
  }
  EXPECT_EQ(none.edges(), 0u);
  EXPECT_LE(one.edges(), 200u);
  EXPECT_GT(looser, 100u);
  EXPECT_GT(better_than_hull, 0u);
}

TEST(SupportTable, OfBlocksHasOneGraphForEach) {
  const Polytope set(coupled_in_pairs(7, 8), cube(5, 4.0));
  SupportTable table = table_of(set);
  EXPECT_EQ(table.singles(), std::vector<std::size_t>{4});
  ASSERT_EQ(table.graphs().size(), 2u);
  for (const VertexGraph& graph : table.graphs()) {
    // A polygon: as many vertices as facets, each with two neighbours that have it as a neighbour.
    EXPECT_EQ(graph.parameters.size(), 2u);
    for (std::size_t v = 0; v < graph.vertices(); ++v) {
      for (std::size_t r = 0; r < 2; ++r) {
        const std::size_t to = graph.neighbours[2 * v + r];
        EXPECT_TRUE(graph.neighbours[2 * to] == v || graph.neighbours[2 * to + 1] == v);
      }
    }
  }
  EXPECT_EQ(table.graphs()[0].vertices(), set.blocks()[0].facets.size());
  EXPECT_EQ(table.support(std::vector<double>(5, 0.0)), 0.0);
}

TEST(SupportTable, IsNoneWhereThereIsNoRoom) {
  const Polytope set(half_spaces(5, 4, 40, false), cube(4, 4.0));
  const std::size_t vertices = table_of(set).graphs().front().vertices();
  EXPECT_GT(vertices, 20u);
  EXPECT_TRUE(SupportTable::make(set, {.vertices = vertices}));
  EXPECT_FALSE(SupportTable::make(set, {.vertices = vertices - 1}));
  EXPECT_THROW(static_cast<void>(SupportTable::make(set, {.slots = 0})), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::bounds::support_table_test

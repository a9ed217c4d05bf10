// SPDX-License-Identifier: Apache-2.0
// The walk from vertex to vertex: never below the exact support, equal to it where the budget lasts, without
// allocation.
#include <cmath>

#include <gtest/gtest.h>

#include "bounds/feasible_set.hpp"
#include "bounds/support_walk.hpp"
#include "core/error.hpp"
#include "tests/bounds/exact.hpp"
#include "tests/bounds/rows.hpp"

namespace wheelwright::bounds::support_walk_test {
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
    rows.back().origin.sample = r;
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

SupportWalkOptions walked(std::size_t budget = 64) {
  SupportWalkOptions options;
  options.few = 0;
  options.budget = budget;
  return options;
}

TEST(SupportWalk, IsNeverBelowTheExactSupportWhateverTheBudget) {
  for (const bool quantised : {false, true}) {
    for (std::size_t p = 1; p <= 3; ++p) {
      const auto rows = half_spaces(p, p, 12, quantised);
      const Polytope set(rows, cube(p, 4.0));
      const auto vertices = exact::vertices(exact::rows_of(rows, cube(p, 4.0)), p);
      ASSERT_FALSE(vertices.empty());
      for (const std::size_t budget : {0, 1, 64}) {
        SupportWalk walk(set, walked(budget));
        for (std::size_t k = 0; k < 300; ++k) {
          const std::vector<double> a = direction(7 * k, p);
          const exact::Rational bound = rational(walk.support(a, k % 2));
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
  }
}

TEST(SupportWalk, IsTheSupportOfTheLinearProgram) {
  for (const bool quantised : {false, true}) {
    for (const std::size_t p : {2, 4, 7}) {
      PolytopeOptions without;
      without.vertex_limit = 0;
      const Polytope set(half_spaces(10 + p, p, 60, quantised), cube(p, 4.0), without);
      SupportWalk walk(set, walked());
      for (std::size_t k = 0; k < 500; ++k) {
        std::vector<double> a = direction(k, p);
        const double above = walk.support(a, 0), expected = set.support(a);
        for (double& x : a) {
          x = -x;
        }
        const double below = walk.support(a, 1), width = expected + set.support(a);
        EXPECT_NEAR(above, expected, 1e-9 * width) << p << ' ' << k;
        EXPECT_NEAR(below, set.support(a), 1e-9 * width) << p << ' ' << k;
      }
      EXPECT_EQ(walk.count().cut_short, 0u);
      EXPECT_LT(walk.count().edges, 3 * walk.count().directions);
    }
  }
}

// With room for two vertices everything is forgotten all the time, and the answers stay the same.
TEST(SupportWalk, ForgettingCostsTimeOnly) {
  PolytopeOptions without;
  without.vertex_limit = 0;
  const Polytope set(half_spaces(3, 4, 60, false), cube(4, 4.0), without);
  SupportWalkOptions little = walked();
  little.vertices = 2;
  SupportWalk walk(set, walked()), forgetful(set, little);
  for (std::size_t k = 0; k < 400; ++k) {
    const std::vector<double> a = direction(3 * k, 4);
    const double expected = walk.support(a, k % 2);
    EXPECT_NEAR(forgetful.support(a, k % 2), expected, 1e-12 * (1.0 + std::abs(expected)));
  }
  EXPECT_GT(forgetful.count().ratio_tests, walk.count().ratio_tests);
}

TEST(SupportWalk, DoesNotDependOnUnits) {
  const std::vector<double> unit{1e-6, 1.0, 1e6};
  const auto rows = half_spaces(4, 3, 30, false);
  auto scaled = rows;
  Box box = cube(3, 4.0), scaled_box = box;
  for (HalfSpace& row : scaled) {
    for (Eigen::Index j = 0; j < 3; ++j) {
      row.a[j] *= unit[static_cast<std::size_t>(j)];
    }
  }
  for (std::size_t j = 0; j < 3; ++j) {
    scaled_box.sides[j] = {-4.0 / unit[j], 4.0 / unit[j]};
  }
  SupportWalk walk(Polytope(rows, box), walked()), other(Polytope(scaled, scaled_box), walked());
  for (std::size_t k = 0; k < 200; ++k) {
    std::vector<double> a = direction(5 * k, 3);
    const double expected = walk.support(a);
    for (std::size_t j = 0; j < 3; ++j) {
      a[j] *= unit[j];
    }
    EXPECT_NEAR(other.support(a), expected, 1e-9 * (1.0 + std::abs(expected)));
  }
}

TEST(SupportWalk, ABudgetOfNothingIsNoWorseThanTheHull) {
  PolytopeOptions without;
  without.vertex_limit = 0;
  const Polytope set(half_spaces(5, 5, 80, false), cube(5, 4.0), without);
  SupportWalk walk(set, walked(0)), full(set, walked());
  bool tighter = false;
  for (std::size_t k = 0; k < 200; ++k) {
    const std::vector<double> a = direction(9 * k, 5);
    EXPECT_LE(walk.support(a), set.hull().support(a));
    std::vector<double> at(5);
    static_cast<void>(set.support(a, at));
    const exact::Rational reached = exact::dot(a, exact::pulled_inside(set.facets(), at, set.centre()));
    EXPECT_TRUE(reached <= exact::rational(walk.support(a)));
    EXPECT_TRUE(reached <= exact::rational(full.support(a)));
    tighter = tighter || walk.support(a) < set.hull().support(a);
  }
  EXPECT_TRUE(tighter);
  EXPECT_GT(walk.count().cut_short, 0u);
  EXPECT_EQ(walk.support(std::vector<double>(5, 0.0)), 0.0);
  EXPECT_THROW(SupportWalk(set, SupportWalkOptions{.slots = 0}), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::bounds::support_walk_test

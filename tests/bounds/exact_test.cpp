// SPDX-License-Identifier: Apache-2.0
// Guarantees against exact rationals, with zero tolerance.
#include <gtest/gtest.h>

#include "bounds/certificate.hpp"
#include "bounds/feasible_set.hpp"
#include "bounds/minimax.hpp"
#include "bounds/slab_rows.hpp"
#include "tests/bounds/exact.hpp"
#include "tests/bounds/rows.hpp"

namespace wheelwright::bounds::exact_test {
namespace {

using exact::rational;
using testing_rows::Random;
using testing_rows::Rows;

/// The half-spaces of all rows, as the library makes them (tested on its own below).
std::vector<HalfSpace> half_spaces(const RegressionBlock& block, const Box& prior) {
  const SlabRows slabs(prior);
  std::vector<HalfSpace> all;
  HalfSpace upper, lower;
  for (Eigen::Index r = 0; r < block.rows(); ++r) {
    slabs.half_spaces(block, r, upper, lower);
    all.push_back(upper);
    all.push_back(lower);
  }
  return all;
}

struct Problem {
  Rows rows;
  Box prior;
};

/// Kinds: 0 generic; 1 quantised (many facets through one vertex); 2 nearly collinear columns; 3 columns from 1e-6 to
/// 1e6; 4 fewer rows than parameters; 5 exact data (a set without interior).
Problem problem(std::uint64_t seed, std::size_t p, int kind) {
  Random random(seed);
  Problem result{Rows(p), testing_rows::cube(p, 64.0)};
  const std::vector<double> truth = random.vector(p);
  std::vector<double> scale(p, 1.0);
  for (std::size_t j = 0; j < p && kind == 3; ++j) {
    scale[j] = std::pow(10.0, 6.0 * random.symmetric());
    result.prior.sides[j] = {-64.0 / scale[j], 64.0 / scale[j]};
  }
  const std::size_t count = kind == 4 ? p - 1 : 8;
  for (std::size_t r = 0; r < count; ++r) {
    std::vector<double> Y = random.vector(p);
    double y = 0.0, noise = 0.25;
    for (std::size_t j = 0; j < p; ++j) {
      if (kind == 1 || kind == 5) {
        Y[j] = std::round(4.0 * Y[j]) / 4.0;
      } else if (kind == 2 && j > 0) {
        Y[j] = Y[0] * (1.0 + 1e-7 * Y[j]);
      }
      y += Y[j] * (kind == 5 ? std::round(8.0 * truth[j]) / 8.0 : truth[j]);
      Y[j] *= scale[j];
    }
    if (kind == 5) {
      noise = 0.0;
    } else {
      y += noise * random.symmetric();
      y = kind == 1 ? std::round(4.0 * y) / 4.0 : y;
      noise = kind == 1 ? 0.5 : noise;
    }
    result.rows.add(Y, y, noise);
  }
  return result;
}

class AgainstRationals : public ::testing::TestWithParam<int> {};

TEST_P(AgainstRationals, hull_and_support_are_never_inside_the_exact_ones) {
  const int kind = GetParam();
  for (std::size_t p = 1; p <= 3; ++p) {
    for (std::uint64_t seed = 1; seed <= 15; ++seed) {
      const Problem each = problem(1000 * seed + static_cast<std::uint64_t>(kind), p, kind);
      core::RegressionTable table = each.rows.table();
      const FeasibleSet set = feasible_set(table, each.prior);
      ASSERT_EQ(set.status, FeasibleSet::Status::nonempty) << p << ' ' << seed;
      const auto rows = exact::rows_of(half_spaces(table.block(), each.prior), each.prior);
      const auto vertices = exact::vertices(rows, p);
      ASSERT_FALSE(vertices.empty());
      Random random(seed);
      for (const auto& vertex : vertices) {
        for (std::size_t j = 0; j < p; ++j) {
          ASSERT_TRUE(rational(set.hull.sides[j].lower) <= vertex[j] && vertex[j] <= rational(set.hull.sides[j].upper))
              << "parameter " << j << " of " << p << ", seed " << seed;
        }
      }
      for (int trial = 0; trial < 8; ++trial) {
        const std::vector<double> a = random.vector(p);
        const exact::Rational support = rational(set.polytope->support(a));
        std::vector<exact::Rational> direction;
        for (const double x : a) {
          direction.push_back(rational(x));
        }
        for (const auto& vertex : vertices) {
          ASSERT_TRUE(exact::dot(direction, vertex) <= support) << "p " << p << ", seed " << seed;
        }
      }
    }
  }
}

class WithInterior : public ::testing::TestWithParam<int> {};

// The excess of the certified hull over the exact one is below 1e-9 of its width.
TEST_P(WithInterior, hull_is_tight) {
  const int kind = GetParam();
  for (std::size_t p = 1; p <= 3; ++p) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const Problem each = problem(1000 * seed + static_cast<std::uint64_t>(kind), p, kind);
      core::RegressionTable table = each.rows.table();
      const FeasibleSet set = feasible_set(table, each.prior);
      const auto vertices = exact::vertices(exact::rows_of(half_spaces(table.block(), each.prior), each.prior), p);
      for (std::size_t j = 0; j < p; ++j) {
        exact::Rational low = vertices.front()[j], high = low;
        for (const auto& vertex : vertices) {
          low = vertex[j] < low ? vertex[j] : low;
          high = vertex[j] > high ? vertex[j] : high;
        }
        const exact::Rational allowed = (high - low) / 1000000000;
        EXPECT_TRUE(low - rational(set.hull.sides[j].lower) <= allowed) << p << ' ' << seed << ' ' << j;
        EXPECT_TRUE(rational(set.hull.sides[j].upper) - high <= allowed) << p << ' ' << seed << ' ' << j;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, AgainstRationals, ::testing::Range(0, 6));
INSTANTIATE_TEST_SUITE_P(Kinds, WithInterior, ::testing::Range(0, 5));

// Bounds raised to 1 + 1e-9 of the smallest that leaves anything: the sliver that remains is inside the hull.
TEST(NearlyEmpty, sliver_is_enclosed) {
  for (std::size_t p = 1; p <= 3; ++p) {
    for (std::uint64_t seed = 1; seed <= 10; ++seed) {
      const Problem each = problem(seed, p, 0);
      RegressionBlock block = each.rows.block(0, each.rows.instants());
      block.dy.setZero();
      core::RegressionTable bare(block);
      block.dy.setConstant(minimax_fit(bare, each.prior).upper * (1.0 + 1e-9));
      core::RegressionTable tight(block);
      const FeasibleSet set = feasible_set(tight, each.prior);
      ASSERT_EQ(set.status, FeasibleSet::Status::nonempty) << p << ' ' << seed;
      const auto vertices = exact::vertices(exact::rows_of(half_spaces(block, each.prior), each.prior), p);
      ASSERT_FALSE(vertices.empty());
      for (const auto& vertex : vertices) {
        for (std::size_t j = 0; j < p; ++j) {
          ASSERT_TRUE(rational(set.hull.sides[j].lower) <= vertex[j] && vertex[j] <= rational(set.hull.sides[j].upper));
        }
      }
    }
  }
}

// Up to p = 12 the exact optimum is read off the binding rows: where they meet, exactly, is a point of the set when it
// satisfies every row exactly; the published bound must not be inside it, and must be within 1e-9 of the width.
TEST(HigherDimensions, certified_hull_encloses_exact_vertices) {
  std::size_t compared = 0, wanted = 0;
  for (std::size_t p = 4; p <= 12; p += 4) {
    Random random(p);
    const std::vector<double> truth = random.vector(p);
    Rows rows(p);
    std::vector<double> scale(p);
    Box prior;
    for (double& x : scale) {
      x = std::pow(10.0, 6.0 * random.symmetric());
      prior.sides.push_back({-64.0 / x, 64.0 / x});
    }
    for (int k = 0; k < 120; ++k) {
      std::vector<double> Y = random.vector(p);
      double y = 0.1 * random.symmetric();
      for (std::size_t j = 0; j < p; ++j) {
        y += Y[j] * truth[j];
        Y[j] *= scale[j];
      }
      rows.add(Y, y, 0.1);
    }
    core::RegressionTable table = rows.table();
    const FeasibleSet set = feasible_set(table, prior);
    ASSERT_EQ(set.status, FeasibleSet::Status::nonempty);
    const auto all = exact::rows_of(half_spaces(table.block(), prior), prior);
    for (std::size_t j = 0; j < p; ++j) {
      for (const bool upper : {false, true}) {
        ++wanted;
        const CertifiedBound& bound = upper ? set.upper[j] : set.lower[j];
        if (bound.binding.size() != p) {
          continue;
        }
        std::vector<exact::Row> binding;
        std::vector<std::size_t> everyone;
        for (const WeightedRow& weighted : bound.binding) {
          const std::vector<HalfSpace> one{weighted.row};
          binding.push_back(exact::rows_of(one, Box{}).front());
          everyone.push_back(everyone.size());
        }
        const auto vertex = exact::meet(binding, everyone);
        bool inside = vertex.has_value();
        for (std::size_t i = 0; inside && i < all.size(); ++i) {
          inside = exact::dot(all[i].a, *vertex) <= all[i].b;
        }
        if (!inside) {
          continue;
        }
        ++compared;
        const exact::Rational value = (*vertex)[j], published = rational(bound.value);
        const exact::Rational excess = upper ? published - value : value - published;
        EXPECT_TRUE(excess >= 0) << p << ' ' << j;
        EXPECT_TRUE(excess <= rational(set.hull.sides[j].width()) / 1000000000) << p << ' ' << j;
      }
    }
  }
  EXPECT_GE(10 * compared, 9 * wanted);
}

// Any multipliers prove a bound that holds: the certificate does not trust the solver.
TEST(Certificate, holds_for_arbitrary_multipliers) {
  Random random(7);
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const std::size_t p = 1 + seed % 3;
    const Problem each = problem(seed, p, 0);
    const RegressionBlock block = each.rows.block(0, each.rows.instants());
    std::vector<HalfSpace> rows = half_spaces(block, each.prior);
    const auto vertices = exact::vertices(exact::rows_of(rows, each.prior), p);
    const std::vector<double> a = random.vector(p);
    std::vector<WeightedRow> weighted;
    for (const HalfSpace& row : rows) {
      weighted.push_back({row, random.unit()});
    }
    const exact::Rational bound = rational(certified_upper_bound(a, weighted, each.prior));
    std::vector<exact::Rational> direction;
    for (const double x : a) {
      direction.push_back(rational(x));
    }
    for (const auto& vertex : vertices) {
      ASSERT_TRUE(exact::dot(direction, vertex) <= bound);
    }
  }
}

// An empty set: the certificate holds in exact arithmetic, and without any of its rows there is a common point.
TEST(Farkas, contradiction_is_exact_and_irreducible) {
  std::size_t seen = 0;
  for (std::uint64_t seed = 1; seed <= 60; ++seed) {
    const std::size_t p = 1 + seed % 3;
    Random random(seed);
    Problem each = problem(seed, p, 0);
    const std::size_t wrong = each.rows.instants();
    each.rows.add(random.vector(p), 10.0, 0.25);
    core::RegressionTable table = each.rows.table();
    const FeasibleSet set = feasible_set(table, each.prior);
    ASSERT_EQ(set.status, FeasibleSet::Status::empty) << seed;
    ASSERT_FALSE(set.polytope.has_value());
    EXPECT_LE(set.contradiction.size(), p + 1);
    EXPECT_TRUE(exact::contradict(set.contradiction, each.prior)) << seed;
    bool names_it = false;
    for (std::size_t left_out = 0; left_out < set.contradiction.size(); ++left_out) {
      names_it = names_it || set.contradiction[left_out].row.origin.sample == wrong;
      std::vector<HalfSpace> others;
      for (std::size_t k = 0; k < set.contradiction.size(); ++k) {
        if (k != left_out) {
          others.push_back(set.contradiction[k].row);
        }
      }
      EXPECT_FALSE(exact::vertices(exact::rows_of(others, each.prior), p).empty()) << seed;
      ++seen;
    }
    EXPECT_TRUE(names_it);
  }
  EXPECT_GT(seen, 100U);
}

}  // namespace
}  // namespace wheelwright::bounds::exact_test

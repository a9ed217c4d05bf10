// SPDX-License-Identifier: Apache-2.0
// Inclusion and intersection of sets; on-line sets allocate nothing.
#include <gtest/gtest.h>

#include <wheelwright/bounds/certificate.hpp>
#include <wheelwright/bounds/ellipsoid.hpp>
#include <wheelwright/bounds/set_operations.hpp>
#include <wheelwright/bounds/support_walk.hpp>
#include <wheelwright/bounds/zonotope.hpp>

#include "bounds/exact.hpp"
#include "bounds/rows.hpp"
#include "support/allocations.hpp"

namespace wheelwright::set_operations_test {
namespace {

using testing_rows::Random;

/// Slabs of half-width `half` about `truth`, moved by less than half of it.
Polytope drive(std::uint64_t seed, const std::vector<double>& truth, double half, std::vector<HalfSpace>& rows) {
  Random random(seed);
  const auto p = static_cast<Eigen::Index>(truth.size());
  const std::size_t first = rows.size();
  for (Eigen::Index r = 0; r < 3 * p; ++r) {
    const std::vector<double> Y = random.vector(truth.size());
    const Eigen::VectorXd a = Eigen::Map<const Eigen::VectorXd>(Y.data(), p);
    const double y = a.dot(Eigen::Map<const Eigen::VectorXd>(truth.data(), p)) + 0.5 * half * random.symmetric();
    rows.push_back({a, y + half, {}});
    rows.push_back({-a, half - y, {}});
  }
  const std::vector<HalfSpace> own(rows.begin() + static_cast<std::ptrdiff_t>(first), rows.end());
  return {own, testing_rows::cube(truth.size(), 50.0)};
}

TEST(Intersection, of_drives_is_the_set_of_all_their_rows) {
  for (std::size_t p = 1; p <= 4; ++p) {
    Random random(p);
    const std::vector<double> truth = random.vector(p);
    std::vector<HalfSpace> rows;
    std::vector<Polytope> drives;
    for (std::uint64_t k = 0; k < 3; ++k) {
      drives.push_back(drive(10 * p + k, truth, 0.5, rows));
    }
    const auto result = intersection(drives);
    ASSERT_TRUE(std::holds_alternative<Polytope>(result));
    const Polytope& both = std::get<Polytope>(result);
    const Polytope together(rows, testing_rows::cube(p, 50.0));
    EXPECT_TRUE(both.contains(truth));
    for (int trial = 0; trial < 30; ++trial) {
      const std::vector<double> a = random.vector(p);
      EXPECT_NEAR(both.support(a), together.support(a), 1e-8 * width(together, a));
      for (const Polytope& each : drives) {
        EXPECT_LE(both.support(a), each.support(a) + 1e-8 * width(each, a));
      }
    }
    for (const Polytope& each : drives) {
      EXPECT_LE(protrusion(each.facets(), both), 1e-8);
    }
  }
}

TEST(Intersection, of_drives_that_contradict_each_other_is_a_proof) {
  for (std::size_t p = 1; p <= 3; ++p) {
    Random random(p);
    std::vector<HalfSpace> rows;
    const std::vector<double> one = random.vector(p);
    std::vector<double> other = one;
    other[p - 1] += 40.0;
    const std::vector<Polytope> drives{drive(p, one, 0.5, rows), drive(p + 7, other, 0.5, rows)};
    const auto result = intersection(drives);
    ASSERT_TRUE(std::holds_alternative<std::vector<WeightedRow>>(result));
    const Box box = hull(drives[0].hull(), drives[1].hull());
    const auto& proof = std::get<std::vector<WeightedRow>>(result);
    EXPECT_FALSE(proof.empty());
    EXPECT_TRUE(proves_empty(proof, box));
    EXPECT_TRUE(exact::contradict(proof, box));
  }
  EXPECT_THROW(static_cast<void>(intersection(std::vector<Polytope>{})), InvalidArgument);
}

TEST(Inclusion, is_proved_with_room_and_not_without) {
  for (std::size_t p = 1; p <= 4; ++p) {
    Random random(p);
    const std::vector<double> truth = random.vector(p);
    std::vector<HalfSpace> rows, more;
    const Polytope small = drive(p, truth, 0.25, rows);
    for (const HalfSpace& row : rows) {
      more.push_back({row.a, row.b + 0.01, {}});
    }
    const Polytope large(more, testing_rows::cube(p, 50.0));
    EXPECT_TRUE(includes(large, small));
    EXPECT_FALSE(includes(small, large));
    EXPECT_TRUE(includes(small, small));
    EXPECT_LT(protrusion(large.facets(), small), 0.0);
    EXPECT_GT(protrusion(small.facets(), large), 0.0);
    Box roomy = small.hull();
    for (Interval& side : roomy.sides) {
      side = {side.lower - 1e-3, side.upper + 1e-3};
    }
    EXPECT_TRUE(includes(roomy, small));
    EXPECT_FALSE(includes(small.hull(), roomy));
    EXPECT_FALSE(includes(small, small.hull()) && p > 1);
    // A set that is around another does not fit into it, unless both are intervals.
    EXPECT_EQ(protrusion(small.facets(), outer_ellipsoid(small)) > 1e-6, p > 1);
    EXPECT_EQ(protrusion(small.facets(), outer_zonotope(small)) > 1e-6, p > 1);
  }
  EXPECT_THROW(static_cast<void>(includes(testing_rows::cube(2, 1.0), testing_rows::cube(3, 1.0))), InvalidArgument);
}

#ifdef WHEELWRIGHT_COUNTS_ALLOCATIONS
TEST(OnlineSets, allocate_nothing) {
  std::vector<HalfSpace> rows;
  const std::vector<double> truth{1.0, -1.0, 0.5, 2.0};
  const Polytope polytope = drive(3, truth, 0.5, rows);
  const Ellipsoid ellipsoid = outer_ellipsoid(polytope);
  const Zonotope zonotope = outer_zonotope(polytope);
  const std::vector<double> a{0.3, -1.0, 2.0, 0.1};
  std::vector<double> at(4);
  const auto count = [&](const auto& set) {
    EXPECT_TRUE(set.is_online());
    const std::size_t before = testing_support::allocations;
    const double value = set.support(a) + set.support(a, at);
    const std::size_t after = testing_support::allocations;
    EXPECT_GT(value, 0.0);
    return after - before;
  };
  EXPECT_EQ(count(polytope.hull()), 0U);
  SupportWalk walk(polytope, {.few = 0});
  const std::size_t before = testing_support::allocations;
  const double value = walk.support(a, 0) + walk.support(a, 1);
  EXPECT_EQ(testing_support::allocations, before);
  EXPECT_GT(value, 0.0);
  EXPECT_EQ(count(ellipsoid), 0U);
  EXPECT_EQ(count(zonotope), 0U);
}
#endif

}  // namespace
}  // namespace wheelwright::set_operations_test

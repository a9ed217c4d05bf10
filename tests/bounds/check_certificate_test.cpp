// SPDX-License-Identifier: Apache-2.0
// The checker of certificates against closed forms and exact oracles: zero tolerance, in both directions.
#include "bounds/check_certificate.hpp"

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bounds/feasible_set.hpp"
#include "core/limits.hpp"
#include "tests/bounds/exact.hpp"
#include "tests/bounds/rows.hpp"

namespace wheelwright::bounds::check_certificate_test {

using core::kInfinity;

namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing_rows::cube;
using testing_rows::Random;
using testing_rows::Rows;

constexpr double kTiny = std::numeric_limits<double>::denorm_min();

WeightedRow weighted(const std::vector<double>& a, double b, double multiplier) {
  return {{Eigen::Map<const Eigen::VectorXd>(a.data(), static_cast<Eigen::Index>(a.size())), b, {}}, multiplier};
}

TEST(ExactSum, IsTheSmallestDoubleThatIsNotBelow) {
  EXPECT_EQ(exact_sum({}), 0.0);
  // The double 0.1 is above a tenth: ten of them are above 1, though rounding to nearest makes less of them.
  const std::vector<double> tenths(10, 0.1);
  EXPECT_EQ(exact_sum(tenths), std::nextafter(1.0, 2.0));
  EXPECT_EQ(exact_sum(std::array{1e300, 1e-9, -1e300}), 1e-9);
  EXPECT_EQ(exact_sum(std::array{1.0, kTiny}), std::nextafter(1.0, 2.0));
  EXPECT_EQ(exact_sum(std::array{1.0, kInfinity}), kInfinity);
}

TEST(CheckBound, TheBoxAloneProvesItsSupport) {
  const Box box{{{-1.0, 2.0}, {-3.0, 5.0}}};
  const std::array a{2.0, -1.0};
  const CertificateCheck tight = check_bound(a, {}, box, 7.0);
  EXPECT_TRUE(tight.proved);
  EXPECT_EQ(tight.bound, 7.0);
  EXPECT_EQ(tight.shortfall, 0.0);
  EXPECT_THAT(tight.reason, IsEmpty());
  const CertificateCheck inward = check_bound(a, {}, box, core::round_down(7.0));
  EXPECT_FALSE(inward.proved);
  EXPECT_EQ(inward.shortfall, 7.0 - core::round_down(7.0));
}

// { ±θ_1 ± … ± θ_p <= 1 } is the ball of the ℓ1 norm: θ_1 <= 1 by two rows of opposite signs in all the rest.
TEST(CheckBound, TheBallOfTheL1NormIsTight) {
  for (std::size_t p = 1; p <= 12; ++p) {
    std::vector<double> plus(p, 1.0), minus(p, -1.0), axis(p, 0.0);
    minus[0] = axis[0] = 1.0;
    const std::vector<WeightedRow> rows{weighted(plus, 1.0, 0.5), weighted(minus, 1.0, 0.5)};
    const CertificateCheck check = check_bound(axis, rows, cube(p, 1e300), 1.0);
    EXPECT_TRUE(check.proved);
    EXPECT_EQ(check.bound, 1.0);
    EXPECT_FALSE(check_bound(axis, rows, cube(p, 1e300), core::round_down(1.0)).proved);
  }
}

// 3θ <= 1 with λ = fl(1/3) = (1 − 2⁻⁵⁴)/3: what is left is 2⁻⁵⁴ θ, at most 2⁻⁵¹ over [−8, 8].
TEST(CheckBound, TheRemainderOfARoundedMultiplierCountsExactly) {
  const double third = 1.0 / 3.0;
  const CertificateCheck check =
      check_bound(std::array{1.0}, std::vector{weighted({3.0}, 1.0, third)}, cube(1, 8.0), third);
  EXPECT_FALSE(check.proved);
  EXPECT_EQ(check.shortfall, 0x1p-51);
  EXPECT_EQ(check.bound, third + 0x1p-51);
  EXPECT_EQ(check.parameter, 0u);
  EXPECT_FALSE(check.row.has_value());
  EXPECT_TRUE(check_bound(std::array{1.0}, std::vector{weighted({3.0}, 1.0, third)}, cube(1, 8.0), check.bound).proved);
  EXPECT_FALSE(check_bound(std::array{1.0}, std::vector{weighted({3.0}, 1.0, third)}, cube(1, 8.0),
                           core::round_down(check.bound))
                   .proved);
}

// 3 · fl(0.1) lies between fl(0.3) and the next double: neither 3 * 0.1 nor 0.3 in floating point would tell.
TEST(CheckBound, NothingIsRoundedBeforeTheComparison) {
  const std::vector rows{weighted({3.0}, 0.1 * 9.0, 1.0), weighted({-2.0}, 0.0, 1.0)};
  const std::vector scaled{weighted({1.0 / 4.0}, 0.1, 3.0), weighted({1.0 / 8.0}, 0.0, 2.0)};
  const CertificateCheck low = check_bound(std::array{1.0}, scaled, cube(1, 1.0), 0.3);
  EXPECT_FALSE(low.proved);
  EXPECT_GT(low.shortfall, 0.0);
  EXPECT_LT(low.shortfall, core::round_up(0.3) - 0.3);
  EXPECT_EQ(low.bound, core::round_up(0.3));
  EXPECT_TRUE(check_bound(std::array{1.0}, scaled, cube(1, 1.0), core::round_up(0.3)).proved);
  EXPECT_TRUE(check_bound(std::array{1.0}, rows, cube(1, 1.0), 0.1 * 9.0).proved);
}

TEST(CheckBound, TheEndsOfTheDoublesAreNoTrap) {
  const CertificateCheck tiny =
      check_bound(std::array{1.0}, std::vector{weighted({2.0}, kTiny, 0.5)}, cube(1, 1e300), 0.0);
  EXPECT_FALSE(tiny.proved);
  EXPECT_EQ(tiny.bound, kTiny);
  EXPECT_TRUE(check_bound(std::array{1.0}, std::vector{weighted({2.0}, kTiny, 0.5)}, cube(1, 1e300), kTiny).proved);
  const double most = std::numeric_limits<double>::max();
  const CertificateCheck huge =
      check_bound(std::array{1.0}, std::vector{weighted({1.0}, most, most)}, cube(1, most), most);
  EXPECT_FALSE(huge.proved);
  EXPECT_EQ(huge.bound, kInfinity);
}

TEST(CheckBound, WhatNoCertificateMayHoldIsNamed) {
  const WeightedRow good = weighted({1.0, 0.0}, 1.0, 1.0);
  const std::array a{1.0, 0.0};
  const double nan = std::nan("");
  const auto second = [&](const WeightedRow& bad) {
    const CertificateCheck check = check_bound(a, std::vector{good, bad}, cube(2, 5.0), 4.0);
    EXPECT_FALSE(check.proved);
    EXPECT_EQ(check.row, 1u);
    EXPECT_EQ(check.bound, kInfinity);
    EXPECT_EQ(check.shortfall, kInfinity);
    return check.reason;
  };
  EXPECT_TRUE(check_bound(a, std::vector{good}, cube(2, 5.0), 4.0).proved);
  for (const double multiplier : {-1e-300, -kTiny, nan, kInfinity, -kInfinity}) {
    EXPECT_THAT(second(weighted({0.0, 0.0}, 1.0, multiplier)), HasSubstr("multiplier")) << multiplier;
  }
  EXPECT_THAT(second(weighted({1.0}, 1.0, 1.0)), HasSubstr("1 coefficients: expected 2"));
  EXPECT_THAT(second(weighted({1.0, 0.0, 0.0}, 1.0, 0.0)), HasSubstr("3 coefficients: expected 2"));
  EXPECT_THAT(second(weighted({nan, 0.0}, 1.0, 0.0)), HasSubstr("not finite"));
  EXPECT_THAT(second(weighted({1.0, 0.0}, kInfinity, 0.0)), HasSubstr("not finite"));

  WeightedRow side = weighted({0.0, 1.0}, 5.0, 0.0);
  side.row.origin = {.is_prior = true, .parameter = 1};
  EXPECT_TRUE(check_bound(a, std::vector{good, side}, cube(2, 5.0), 4.0).proved);
  side.row.b = core::round_down(5.0);
  EXPECT_THAT(second(side), HasSubstr("side of the box"));
}

TEST(CheckBound, AMisstatedQuestionIsAnswered) {
  const std::vector rows(4, weighted({1.0, 0.0}, 1.0, 0.25));
  const std::array a{1.0, 0.0};
  EXPECT_THAT(check_bound(a, rows, cube(2, 5.0), 4.0).reason, HasSubstr("4 rows: expected at most 3"));
  EXPECT_TRUE(check_bound(a, std::span(rows).first(3), cube(2, 5.0), 4.0).proved);
  EXPECT_THAT(check_bound(std::array{1.0}, {}, cube(2, 5.0), 4.0).reason, HasSubstr("2 finite coefficients"));
  EXPECT_THAT(check_bound(std::array{1.0, kInfinity}, {}, cube(2, 5.0), 4.0).reason, HasSubstr("finite coefficients"));
  EXPECT_THAT(check_bound(a, {}, cube(2, 5.0), std::nan("")).reason, HasSubstr("claimed bound"));
  EXPECT_THAT(check_bound(a, {}, Box{{{0.0, 1.0}, {1.0, 0.0}}}, 4.0).reason, HasSubstr("side of the box"));
  EXPECT_THAT(check_bound(a, {}, Box{{{0.0, kInfinity}, {0.0, 1.0}}}, 4.0).reason, HasSubstr("not finite"));
}

TEST(CheckBound, TheRowThatSpoilsAProofIsNamed) {
  const std::array a{1.0, 0.0};
  std::vector<WeightedRow> rows{weighted({1.0, 1.0}, 1.0, 0.5), weighted({1.0, -1.0}, 1.0, 0.5),
                                weighted({0.0, 1.0}, 2.0, 0.0)};
  EXPECT_TRUE(check_bound(a, rows, cube(2, 100.0), 1.0).proved);
  rows[2].multiplier = 1e-6;
  const CertificateCheck check = check_bound(a, rows, cube(2, 100.0), 1.0);
  EXPECT_FALSE(check.proved);
  EXPECT_EQ(check.row, 2u);
  EXPECT_EQ(check.parameter, 1u);
  EXPECT_NEAR(check.shortfall, 1.02e-4, 1e-16);
}

TEST(CheckEmptiness, TouchingIsNotEmptyAnUlpApartIs) {
  const Box box = cube(1, 1e9);
  const auto apart = [&](double gap_from) {
    return check_emptiness(std::vector{weighted({1.0}, 1.0, 1.0), weighted({-1.0}, -gap_from, 1.0)}, box);
  };
  EXPECT_FALSE(apart(1.0).proved);
  EXPECT_EQ(apart(1.0).shortfall, 0.0);
  EXPECT_TRUE(apart(core::round_up(1.0)).proved);
  EXPECT_EQ(apart(core::round_up(1.0)).shortfall, 1.0 - core::round_up(1.0));
  EXPECT_TRUE(apart(2.0).proved);
  // A remainder of 2⁻²⁰ over a box of 1e9 is more than the gap.
  const std::vector loose{weighted({1.0}, 1.0, 1.0 + 0x1p-20), weighted({-1.0}, -2.0, 1.0)};
  EXPECT_FALSE(check_emptiness(loose, box).proved);
  EXPECT_TRUE(check_emptiness(loose, cube(1, 1e3)).proved);
}

/// A seeded regression of p parameters with rows of a half-width around the truth.
Rows drive(Random& random, std::size_t p, std::size_t n, double half) {
  Rows rows(p);
  const std::vector<double> truth = random.vector(p);
  for (std::size_t k = 0; k < n; ++k) {
    const std::vector<double> Y = random.vector(p);
    double y = 0.8 * half * random.symmetric();
    for (std::size_t j = 0; j < p; ++j) {
      y += Y[j] * truth[j];
    }
    rows.add(Y, y, half);
  }
  return rows;
}

std::pair<std::vector<BoundClaim>, std::vector<BoundClaim>> claims_of(const FeasibleSet& set) {
  std::vector<BoundClaim> lower, upper;
  for (std::size_t j = 0; j < set.lower.size(); ++j) {
    lower.push_back({set.lower[j].value, set.lower[j].binding});
    upper.push_back({set.upper[j].value, set.upper[j].binding});
  }
  return {lower, upper};
}

// What the engine publishes is proved, also where the prior is so wide that the rounding of λ would ruin one step
// alone; what it does not publish is not.
TEST(CheckHullAgainstRationals, ProvesWhatIsPublishedAndNothingMore) {
  Random random(11);
  for (const double width : {10.0, 1e12}) {
    for (const std::size_t p : {1, 2, 3, 5, 8}) {
      core::RegressionTable rows = drive(random, p, 60 * p, 0.1).table();
      const Box prior = cube(p, width);
      const FeasibleSet set = feasible_set(rows, prior);
      ASSERT_EQ(set.status, FeasibleSet::Status::nonempty);
      const auto [lower, upper] = claims_of(set);
      const HullCheck check = check_hull(lower, upper, prior);
      EXPECT_TRUE(check.all_proved()) << "p = " << p << ", prior of " << width;
      EXPECT_FALSE(check.contradiction);
      for (std::size_t j = 0; j < p; ++j) {
        const Interval& side = check.proved.sides[j];
        EXPECT_GE(side.lower, lower[j].value);
        EXPECT_LE(side.upper, upper[j].value);
      }
      const std::size_t j = p / 2;
      const double inward = 1e-9 * (upper[j].value - lower[j].value);
      std::vector<BoundClaim> moved = lower;
      moved[j].value += inward;
      const HullCheck low = check_hull(moved, upper, prior);
      EXPECT_FALSE(low.lower[j].proved);
      EXPECT_NEAR(low.lower[j].shortfall, inward, 1e-3 * inward);
      moved = upper;
      moved[j].value -= inward;
      EXPECT_FALSE(check_hull(lower, moved, prior).upper[j].proved);
      EXPECT_TRUE(check_hull(lower, moved, prior).lower[j].proved);
    }
  }
}

// The claim may be as wrong, the multipliers as arbitrary as they like: what is proved contains every vertex, exactly.
TEST(CheckHullAgainstRationals, NeverProvesWhatIsFalse) {
  Random random(12);
  std::size_t narrowed = 0;
  for (int trial = 0; trial < 18; ++trial) {
    const std::size_t p = 1 + static_cast<std::size_t>(trial) % 3;
    const Box prior = cube(p, 2.0);
    std::vector<HalfSpace> all;
    std::vector<BoundClaim> lower(p), upper(p);
    for (auto* claims : {&lower, &upper}) {
      for (std::size_t j = 0; j < p; ++j) {
        (*claims)[j].value = random.symmetric();
        for (std::size_t i = 0; i < p; ++i) {
          std::vector<double> a = random.vector(p);
          // The first is nearly the direction of the bound, so that something is proved.
          if (i == 0) {
            for (std::size_t k = 0; k < p; ++k) {
              a[k] = (k == j ? (claims == &upper ? 1.0 : -1.0) : 0.0) + 0.1 * a[k];
            }
          }
          (*claims)[j].rows.push_back(weighted(a, 0.2 + random.unit(), i == 0 ? 1.0 : 0.05 * random.unit()));
          all.push_back((*claims)[j].rows.back().row);
        }
      }
    }
    const HullCheck check = check_hull(lower, upper, prior);
    ASSERT_FALSE(check.contradiction);  // all b > 0: the origin is a member
    narrowed += check.proved == prior ? 0 : 1;
    for (const auto& vertex : exact::vertices(exact::rows_of(all, prior), p)) {
      for (std::size_t j = 0; j < p; ++j) {
        EXPECT_LE(exact::rational(check.proved.sides[j].lower), vertex[j]);
        EXPECT_GE(exact::rational(check.proved.sides[j].upper), vertex[j]);
        EXPECT_TRUE(!check.lower[j].proved || exact::rational(lower[j].value) <= vertex[j]);
        EXPECT_TRUE(!check.upper[j].proved || exact::rational(upper[j].value) >= vertex[j]);
      }
    }
  }
  EXPECT_GT(narrowed, 15u);
}

TEST(CheckHull, TamperedCertificatesAreRefused) {
  Random random(13);
  constexpr std::size_t p = 4;
  Rows data = drive(random, p, 200, 0.1);
  core::RegressionTable rows = data.table();
  const Box prior = cube(p, 10.0);
  const auto [lower, upper] = claims_of(feasible_set(rows, prior));
  ASSERT_TRUE(check_hull(lower, upper, prior).all_proved());
  for (std::size_t j = 0; j < p; ++j) {
    for (std::size_t i = 0; i < upper[j].rows.size(); ++i) {
      std::vector<BoundClaim> bad = upper;
      bad[j].rows[i].multiplier *= 1.0 + 1e-6;
      EXPECT_FALSE(check_hull(lower, bad, prior).upper[j].proved) << "multiplier";
      bad = upper;
      bad[j].rows[i].row.b += 1e-6;
      EXPECT_FALSE(check_hull(lower, bad, prior).upper[j].proved) << "right-hand side";
      // A change of a coefficient either way: where θ has one sign, one of the two is a stronger row.
      bool refused = false;
      for (const double change : {-1e-6, 1e-6}) {
        bad = upper;
        bad[j].rows[i].row.a[0] += change;
        refused = refused || !check_hull(lower, bad, prior).upper[j].proved;
      }
      EXPECT_TRUE(refused) << "a coefficient";
      bad = upper;
      bad[j].rows.erase(bad[j].rows.begin() + static_cast<std::ptrdiff_t>(i));
      EXPECT_FALSE(check_hull(lower, bad, prior).upper[j].proved) << "a missing row";
      bad = upper;
      bad[j].rows[i].multiplier *= -1.0;
      EXPECT_EQ(check_hull(lower, bad, prior).upper[j].row, i) << "a negative multiplier";
    }
  }
}

TEST(CheckHull, TheSidesOfThePriorNeedNoRows) {
  const Box prior{{{-1.0, 2.0}, {0.0, 4.0}}};
  const std::vector<BoundClaim> lower{{-1.0, {}}, {0.0, {}}};
  std::vector<BoundClaim> upper{{2.0, {}}, {4.0, {}}};
  EXPECT_TRUE(check_hull(lower, upper, prior).all_proved());
  upper[1].value = core::round_down(4.0);
  const HullCheck check = check_hull(lower, upper, prior);
  EXPECT_TRUE(check.upper[0].proved);
  EXPECT_FALSE(check.upper[1].proved);
  EXPECT_EQ(check.upper[1].shortfall, 4.0 - core::round_down(4.0));
  // A certificate that no one may write is none, even where the claim is trivial.
  upper[1] = {4.0, {weighted({0.0, 1.0}, 1.0, -1.0)}};
  EXPECT_FALSE(check_hull(lower, upper, prior).upper[1].proved);
  EXPECT_THROW((void)check_hull(lower, std::span(upper).first(1), prior), InvalidArgument);
}

TEST(CheckHull, AContradictionIsTold) {
  const std::vector<BoundClaim> lower{{0.5, {weighted({-1.0}, -0.5, 1.0)}}};
  const std::vector<BoundClaim> upper{{0.25, {weighted({1.0}, 0.25, 1.0)}}};
  EXPECT_TRUE(check_hull(lower, upper, cube(1, 1.0)).contradiction);
  EXPECT_TRUE(check_hull(lower, upper, cube(1, 1.0)).all_proved());
  const std::vector<BoundClaim> point{{0.5, {weighted({1.0}, 0.5, 1.0)}}};
  EXPECT_FALSE(check_hull(lower, point, cube(1, 1.0)).contradiction);
  EXPECT_TRUE(check_hull(lower, point, cube(1, 1.0)).all_proved());
}

}  // namespace
}  // namespace wheelwright::bounds::check_certificate_test

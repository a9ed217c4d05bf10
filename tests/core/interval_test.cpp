// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <boost/multiprecision/cpp_int.hpp>

#include "core/check.hpp"
#include "core/interval.hpp"
#include "core/limits.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::core::interval_test {
namespace {

using Rational = boost::multiprecision::cpp_rational;
using testing_support::Random;

// Doubles of either sign between 1e-12 and 1e12.
double wide(Random& random) { return random.symmetric() * std::pow(10.0, 12.0 * random.symmetric()); }

void expect_encloses(Interval enclosure, const Rational& exact) {
  ASSERT_LE(Rational(enclosure.lower), exact);
  ASSERT_GE(Rational(enclosure.upper), exact);
}

// Every result encloses the exact one, which is a rational: no tolerance.
TEST(Interval, EnclosesTheExactResult) {
  Random random(1);
  for (int k = 0; k < 20000; ++k) {
    const double a = wide(random), b = k % 5 == 0 ? a : a + std::abs(wide(random));
    const double c = wide(random), d = k % 7 == 0 ? c : c + std::abs(wide(random));
    const Interval x{a, b}, y{c, d};
    for (const double p : {a, b}) {
      for (const double q : {c, d}) {
        expect_encloses(x + y, Rational(p) + Rational(q));
        expect_encloses(x - y, Rational(p) - Rational(q));
        expect_encloses(x * y, Rational(p) * Rational(q));
      }
    }
    ASSERT_GE(Rational(x.width()), Rational(b) - Rational(a));
    ASSERT_TRUE(x.contains(x.centre()));
  }
}

TEST(Interval, OfSumsThatAreNoDoublesHasAWidth) {
  const Interval sum = Interval{0.1, 0.1} + Interval{0.2, 0.2};
  EXPECT_LT(sum.lower, sum.upper);
  EXPECT_LE(sum.width(), 3.0 * std::numeric_limits<double>::epsilon());
  expect_encloses(sum, Rational(0.1) + Rational(0.2));
}

TEST(Interval, RoundsByOneUnitInTheLastPlace) {
  EXPECT_EQ(round_up(1.0), 1.0 + std::numeric_limits<double>::epsilon());
  EXPECT_EQ(round_down(round_up(1.0)), 1.0);
  EXPECT_EQ(round_up(0.0), std::numeric_limits<double>::denorm_min());
  EXPECT_EQ(round_up(kInfinity), kInfinity);
  EXPECT_EQ(round_down(-kInfinity), -kInfinity);
  EXPECT_TRUE(std::isnan(round_up(std::nan(""))) && std::isnan(round_down(std::nan(""))));
  using Limits = std::numeric_limits<double>;
  Random random(3);
  std::vector<double> all = {0.0, -0.0, 1.0, 0.5, Limits::min(), Limits::denorm_min(), Limits::max(), kInfinity};
  for (int k = 0; k < 1000; ++k) {
    all.push_back(wide(random));
    all.push_back(std::ldexp(random.unit(), -1060));
  }
  for (const double size : all) {
    for (const double x : {size, -size}) {
      EXPECT_EQ(round_up(x), std::nextafter(x, kInfinity)) << x;
      EXPECT_EQ(round_down(x), std::nextafter(x, -kInfinity)) << x;
    }
  }
}

TEST(Interval, NaNIsInNone) { EXPECT_FALSE((Interval{-kInfinity, kInfinity}.contains(std::nan("")))); }

TEST(Check, NaNFails) {
  const double nan = std::nan("");
  EXPECT_THROW(check::finite(nan, "x"), InvalidArgument);
  EXPECT_THROW(check::finite(-kInfinity, "x"), InvalidArgument);
  EXPECT_THROW(check::positive(nan, "x"), InvalidArgument);
  EXPECT_THROW(check::positive(0.0, "x"), InvalidArgument);
  EXPECT_THROW(check::positive(kInfinity, "x"), InvalidArgument);
  EXPECT_THROW(check::non_negative(nan, "x"), InvalidArgument);
  EXPECT_THROW(check::non_negative(-1e-300, "x"), InvalidArgument);
  EXPECT_EQ(check::non_negative(0.0, "x"), 0.0);
  EXPECT_EQ(check::positive(1e-300, "x"), 1e-300);
  try {
    check::positive(-2.0, "wheel_radius");
    FAIL() << "no exception";
  } catch (const InvalidArgument& error) {
    EXPECT_NE(std::string(error.what()).find("wheel_radius is -2"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace wheelwright::core::interval_test

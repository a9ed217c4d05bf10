// SPDX-License-Identifier: Apache-2.0
// Centre and spread: closed cases, recovery, and strange members that do not matter.
#include "study/population.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::study::random_effects_test {
namespace {

using testing_support::Random;

TEST(RandomEffects, AgreesWithTheWeightedMeanWhereErrorsExplainAll) {
  // Differences far below the errors: tau is 0 and every weight 1/s^2.
  const std::vector<double> x = {10.0, 10.1, 9.9, 10.2}, s = {1.0, 2.0, 1.0, 4.0};
  double weight = 0.0, sum = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    weight += 1.0 / (s[i] * s[i]);
    sum += x[i] / (s[i] * s[i]);
  }
  const RandomEffects fit = fit_random_effects(x, s);
  EXPECT_EQ(fit.spread, 0.0);
  EXPECT_NEAR(fit.centre, sum / weight, 1e-10);
}

TEST(RandomEffects, SolvesPauleAndMandelWhereNoMemberIsFarOff) {
  // With all |z| < 1.5, psi(z) = z: sum z = 0 weighted and sum z^2 = (n - 1) E psi^2, here with no errors at all, so
  // that the spread is the standard deviation over sqrt(E psi^2) = 0.8823...
  const std::vector<double> x = {-1.0, -1.0, 1.0, 1.0, -1.0, 1.0}, s(6, 0.0);
  const RandomEffects fit = fit_random_effects(x, s);
  const double inside = std::erf(1.5 / std::sqrt(2.0));
  const double second = inside - 3.0 * std::exp(-1.125) / std::sqrt(2.0 * M_PI) + 2.25 * (1.0 - inside);
  EXPECT_NEAR(fit.centre, 0.0, 1e-9);
  EXPECT_NEAR(fit.spread, std::sqrt(6.0 / 5.0 / second), 1e-6);
}

TEST(RandomEffects, MovesAndScalesWithItsData) {
  Random random(3);
  std::vector<double> x, s, moved, scaled;
  for (int i = 0; i < 40; ++i) {
    s.push_back(0.2 + random.unit());
    x.push_back(2.0 * random.normal() + s.back() * random.normal());
    moved.push_back(5.0 - 3.0 * x.back());
    scaled.push_back(3.0 * s.back());
  }
  const RandomEffects a = fit_random_effects(x, s), b = fit_random_effects(moved, scaled);
  EXPECT_NEAR(b.centre, 5.0 - 3.0 * a.centre, 1e-5);
  EXPECT_NEAR(b.spread, 3.0 * a.spread, 1e-5);
}

TEST(RandomEffects, RecoversTheSpreadBehindTheErrors) {
  Random random(11);
  constexpr int n = 4000;
  std::vector<double> x, s;
  for (int i = 0; i < n; ++i) {
    s.push_back(0.1 + 2.0 * random.unit());
    x.push_back(21.0 + 0.7 * random.normal() + s.back() * random.normal());
  }
  const RandomEffects fit = fit_random_effects(x, s);
  EXPECT_NEAR(fit.centre, 21.0, 4.0 * fit.centre_error);
  EXPECT_NEAR(fit.spread, 0.7, 0.07);
}

TEST(RandomEffects, AFifthOfStrangersDoesNotHideThemselves) {
  Random random(5);
  std::vector<double> x, s;
  for (int i = 0; i < 100; ++i) {
    s.push_back(0.1);
    x.push_back((i % 5 == 0 ? 1e3 : 0.0) + random.normal());
  }
  const RandomEffects fit = fit_random_effects(x, s);
  EXPECT_LT(std::abs(fit.centre), 1.5);
  EXPECT_LT(fit.spread, 3.0);
}

TEST(RandomEffects, LeavesAMemberOut) {
  const std::vector<double> x = {1.0, 2.0, 50.0, 3.0}, s = {0.1, 0.2, 0.3, 0.4};
  const RandomEffects without = fit_random_effects(x, s, 2);
  const RandomEffects rest = fit_random_effects(std::vector<double>{1.0, 2.0, 3.0}, std::vector<double>{0.1, 0.2, 0.4});
  EXPECT_EQ(without.centre, rest.centre);
  EXPECT_EQ(without.spread, rest.spread);
  EXPECT_EQ(without.members, 3U);
}

TEST(RandomEffects, TakesEqualValuesWithoutErrors) {
  const RandomEffects fit = fit_random_effects(std::vector<double>(5, 7.0), std::vector<double>(5, 0.0));
  EXPECT_EQ(fit.centre, 7.0);
  EXPECT_EQ(fit.spread, 0.0);
}

TEST(RandomEffects, RefusesWhatMakesNoSense) {
  const std::vector<double> two = {1.0, 2.0}, one = {1.0}, bad = {1.0, -1.0}, nan = {1.0, std::nan("")};
  EXPECT_THROW((void)fit_random_effects(two, one), InvalidArgument);
  EXPECT_THROW((void)fit_random_effects(one, one), InvalidArgument);
  EXPECT_THROW((void)fit_random_effects(two, bad), InvalidArgument);
  EXPECT_THROW((void)fit_random_effects(nan, two), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::study::random_effects_test

// SPDX-License-Identifier: Apache-2.0
// Two sets of parameters against each other: closed forms on boxes and strips, and on random sets about a known truth
// nothing true is ever refused.
#include "commission/model_comparison.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace wheelwright::commission::model_comparison_test {
namespace {

using bounds::HalfSpace;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

struct Set {
  std::vector<HalfSpace> facets;
  Box box;
  operator ParameterSet() const { return {facets, box}; }
};

void add(Set& set, std::vector<double> a, double b) {
  set.facets.push_back({Eigen::Map<Eigen::VectorXd>(a.data(), static_cast<Eigen::Index>(a.size())), b, {}});
}

// |x + y − sum| <= width and |x − y| <= 10 in the box [−10, 10]².
Set strip(double sum, double width) {
  Set set{{}, Box{{{-10.0, 10.0}, {-10.0, 10.0}}}};
  add(set, {1.0, 1.0}, sum + width);
  add(set, {-1.0, -1.0}, width - sum);
  return set;
}

void expect_close(const Interval& x, double lower, double upper) {
  EXPECT_LE(x.lower, lower);
  EXPECT_GE(x.upper, upper);
  EXPECT_NEAR(x.lower, lower, 1e-6);
  EXPECT_NEAR(x.upper, upper, 1e-6);
}

TEST(ModelComparison, BoxesThatOverlapTellNothing) {
  const Set before{{}, Box{{{0.0, 2.0}, {5.0, 6.0}}}}, after{{}, Box{{{1.0, 4.0}, {5.5, 9.0}}}};
  const SetComparison found = compare_sets(before, after);
  EXPECT_TRUE(found.compatible);
  EXPECT_THAT(found.explanations, IsEmpty());
  ASSERT_THAT(found.parameters, SizeIs(2));
  EXPECT_FALSE(found.parameters[0].certain());
  expect_close(found.parameters[0].change, -1.0, 4.0);
  ASSERT_TRUE(found.parameters[0].together && found.parameters[1].together);
  expect_close(*found.parameters[0].together, 1.0, 2.0);
  expect_close(*found.parameters[1].together, 5.5, 6.0);
}

TEST(ModelComparison, BoxesApartInOneParameterNameIt) {
  const Set before{{}, Box{{{0.0, 1.0}, {5.0, 6.0}}}}, after{{}, Box{{{3.0, 4.0}, {5.5, 9.0}}}};
  const SetComparison found = compare_sets(before, after);
  EXPECT_FALSE(found.compatible);
  EXPECT_TRUE(found.parameters[0].certain());
  EXPECT_FALSE(found.parameters[1].certain());
  ASSERT_THAT(found.explanations, SizeIs(1));
  EXPECT_THAT(found.explanations[0].parameters, ElementsAre(0));
  expect_close(found.explanations[0].change[0], 2.0, 4.0);
}

// Every interval overlaps wholly, and yet no one θ is in both.
TEST(ModelComparison, StripsApartTellAChangeThatNoIntervalShows) {
  const SetComparison found = compare_sets(strip(0.0, 0.5), strip(3.0, 0.5));
  EXPECT_FALSE(found.compatible);
  EXPECT_FALSE(found.parameters[0].certain());
  EXPECT_FALSE(found.parameters[1].certain());
  ASSERT_THAT(found.explanations, SizeIs(2)) << "either parameter alone";
  for (const ChangeExplanation& each : found.explanations) {
    EXPECT_THAT(each.parameters, SizeIs(1));
    expect_close(each.change[0], 2.0, 4.0);
  }
}

TEST(ModelComparison, WhereNoSingleParameterExplainsTwoTogetherAreNamed) {
  Set before{{}, Box{{{0.0, 1.0}, {0.0, 1.0}, {0.0, 1.0}}}}, after = before;
  after.box.sides[0] = {3.0, 4.0};
  after.box.sides[2] = {-5.0, -4.0};
  const SetComparison found = compare_sets(before, after);
  EXPECT_EQ(found.sought, 2U);
  ASSERT_THAT(found.explanations, SizeIs(1));
  EXPECT_THAT(found.explanations[0].parameters, ElementsAre(0, 2));
  expect_close(found.explanations[0].change[0], 2.0, 4.0);
  expect_close(found.explanations[0].change[1], -6.0, -4.0);
  EXPECT_EQ(compare_sets(before, after, 3).sought, 1U) << "as many as may be tried";
}

TEST(ModelComparison, SetsOfDifferentDimensionsAreRefused) {
  const Set two{{}, Box{{{0.0, 1.0}, {0.0, 1.0}}}}, one{{}, Box{{{0.0, 1.0}}}};
  EXPECT_THROW((void)compare_sets(two, one), InvalidArgument);
}

// Rows |a·θ° − a·θ| <= e with e from the truth: sets as logs give them. Every statement is held against the truth.
TEST(ModelComparison, NothingTrueIsRefusedOnRandomSets) {
  std::mt19937_64 random(20261127);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  int told = 0, named = 0;
  for (int k = 0; k < 150; ++k) {
    const std::size_t p = 2 + static_cast<std::size_t>(k % 4);
    Eigen::VectorXd truth = Eigen::VectorXd::NullaryExpr(static_cast<Eigen::Index>(p), [&] { return normal(random); });
    const auto around = [&](const Eigen::VectorXd& theta) {
      Set set{{}, Box{std::vector<Interval>(p, {-30.0, 30.0})}};
      for (int i = 0; i < 30; ++i) {
        std::vector<double> a(p);
        double value = 0.0;
        for (std::size_t j = 0; j < p; ++j) {
          a[j] = normal(random);
          value += a[j] * theta[static_cast<Eigen::Index>(j)];
        }
        const double width = 0.3, error = width * (2.0 * uniform(random) - 1.0);
        std::vector<double> minus(p);
        std::transform(a.begin(), a.end(), minus.begin(), std::negate<>());
        add(set, a, value + error + width);
        add(set, minus, width - value - error);
      }
      return set;
    };
    std::vector<std::size_t> changed;
    Eigen::VectorXd moved = truth;
    for (std::size_t j = 0; j < p && changed.size() < static_cast<std::size_t>(k % 3); ++j) {
      if (uniform(random) < 0.6) {
        changed.push_back(j);
        moved[static_cast<Eigen::Index>(j)] += 2.0 * normal(random);
      }
    }
    const SetComparison found = compare_sets(around(truth), around(moved));
    EXPECT_TRUE(found.compatible || !changed.empty()) << "nothing has changed in case " << k;
    for (std::size_t j = 0; j < p; ++j) {
      const double change = moved[static_cast<Eigen::Index>(j)] - truth[static_cast<Eigen::Index>(j)];
      EXPECT_TRUE(found.parameters[j].change.contains(change)) << k;
      if (found.parameters[j].together && changed.empty()) {
        EXPECT_TRUE(found.parameters[j].together->contains(truth[static_cast<Eigen::Index>(j)])) << k;
      }
    }
    if (found.compatible) {
      continue;
    }
    ++told;
    ASSERT_FALSE(found.explanations.empty()) << k;
    EXPECT_LE(found.explanations[0].parameters.size(), changed.size()) << "fewer may do, more never, in case " << k;
    if (found.explanations[0].parameters.size() == changed.size()) {
      const auto own = std::ranges::find(found.explanations, changed, &ChangeExplanation::parameters);
      ASSERT_NE(own, found.explanations.end()) << "what has changed is among the explanations of case " << k;
      ++named;
      for (std::size_t i = 0; i < changed.size(); ++i) {
        const auto j = static_cast<Eigen::Index>(changed[i]);
        EXPECT_TRUE(own->change[i].contains(moved[j] - truth[j])) << k;
      }
    }
  }
  EXPECT_GT(told, 60) << "the sets are narrow enough to tell something";
  EXPECT_GT(named, 50);
}

TEST(ModelComparison, BestGuessesAreToldFromSixStandardErrorsOn) {
  const std::vector<BestGuess> before{
      {"mass", "kg", 24.0, 0.03}, {"coulomb", "N·m", 0.759, 0.0105}, {"x", "m", 1.0, 0.1}};
  const std::vector<BestGuess> after{
      {"coulomb", "N·m", 0.447, 0.005}, {"mass", "kg", 24.2, 0.04}, {"x", "mm", 1e3, 0.1}};
  ModelComparison comparison;
  comparison.guesses = compare_guesses(before, after);
  ASSERT_THAT(comparison.guesses, SizeIs(2)) << "what is in another unit is another quantity";
  EXPECT_NEAR(comparison.guesses[0].standard_errors(), 4.0, 1e-9);
  EXPECT_NEAR(comparison.guesses[1].standard_errors(), -0.312 / std::hypot(0.0105, 0.005), 1e-9);
  ASSERT_THAT(comparison.likely(), SizeIs(1));
  EXPECT_EQ(comparison.likely().front().before.quantity, "coulomb");
  EXPECT_FALSE(comparison.changed()) << "for certain";
}

}  // namespace
}  // namespace wheelwright::commission::model_comparison_test

// SPDX-License-Identifier: Apache-2.0
// Oracle: models whose expected losses are known, many times over.
#include "gap/causes/candidate.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"

namespace wheelwright::gap::confidence_set_test {
namespace {

constexpr Eigen::Index kBlocks = 24;
constexpr double kLevel = 0.1;

// Losses with a part that all models share, as those of one log have.
std::vector<Eigen::VectorXd> random_losses(std::size_t models, std::mt19937_64& generator) {
  std::normal_distribution<double> normal;
  Eigen::VectorXd common(kBlocks);
  for (double& x : common) {
    x = 10.0 + 3.0 * normal(generator);
  }
  std::vector<Eigen::VectorXd> losses(models, common);
  for (Eigen::VectorXd& loss : losses) {
    for (double& x : loss) {
      x += normal(generator);
    }
  }
  return losses;
}

std::size_t best_of(const std::vector<Eigen::VectorXd>& losses) {
  const auto less = [](const Eigen::VectorXd& a, const Eigen::VectorXd& b) { return a.sum() < b.sum(); };
  return static_cast<std::size_t>(std::min_element(losses.begin(), losses.end(), less) - losses.begin());
}

class EqualModels : public testing::TestWithParam<std::size_t> {};

TEST_P(EqualModels, AreKept) {
  const std::size_t models = GetParam();
  constexpr int kTrials = 400;
  std::mt19937_64 generator(models);
  std::vector<int> dropped(models, 0);
  int any = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    const std::vector<double> p = model_confidence_set(
        random_losses(models, generator), {.resamples = 199, .seed = static_cast<std::uint64_t>(trial) + 1});
    bool all = true;
    for (std::size_t i = 0; i < models; ++i) {
      dropped[i] += p[i] < kLevel ? 1 : 0;
      all = all && p[i] >= kLevel;
    }
    any += all ? 0 : 1;
  }
  for (const int times : dropped) {
    EXPECT_LE(times, 0.1 * kTrials);
  }
  // All of them together: 10 %, and what 24 blocks cost a bootstrap.
  EXPECT_LE(any, 0.2 * kTrials);
  EXPECT_GE(any, 0.02 * kTrials);
}

INSTANTIATE_TEST_SUITE_P(ConfidenceSet, EqualModels, testing::Values(2, 3, 6));

TEST(ConfidenceSet, AClearlyWorseModelIsDroppedAndTakesNoOtherWithIt) {
  std::mt19937_64 generator(5);
  int kept = 0, others = 0;
  for (int trial = 0; trial < 200; ++trial) {
    std::vector<Eigen::VectorXd> losses = random_losses(4, generator);
    losses[2].array() += 2.0;  // seven standard errors of a difference
    const std::vector<double> p = model_confidence_set(losses, {.resamples = 199});
    kept += p[2] >= kLevel ? 1 : 0;
    others += p[0] >= kLevel && p[1] >= kLevel && p[3] >= kLevel ? 1 : 0;
  }
  EXPECT_EQ(kept, 0);
  EXPECT_GE(others, 160);
}

TEST(ConfidenceSet, PValuesFollowTheStudentisedDistanceFromTheBest) {
  std::mt19937_64 generator(8);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<Eigen::VectorXd> losses = random_losses(7, generator);
    for (std::size_t i = 0; i < losses.size(); ++i) {
      losses[i].array() += 0.15 * static_cast<double>(i);
    }
    const std::vector<double> p = model_confidence_set(losses);
    const std::size_t best = best_of(losses);
    EXPECT_EQ(p[best], 1.0);
    std::vector<double> t(losses.size(), -std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i < losses.size(); ++i) {
      if (i != best) {
        const Eigen::ArrayXd d = losses[i] - losses[best];
        t[i] = d.mean() / std::sqrt((d - d.mean()).square().sum());
      }
    }
    std::vector<std::size_t> order(losses.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::sort(order.begin(), order.end(), [&t](std::size_t a, std::size_t b) { return t[a] < t[b]; });
    for (std::size_t k = 1; k < order.size(); ++k) {
      EXPECT_LE(p[order[k]], p[order[k - 1]]);
    }
  }
}

TEST(ConfidenceSet, TwoModelsHaveTheTwoSidedPValueOfTheirDifference) {
  // Differences ±1 with mean 0.5 in 24 blocks, 18 against 6: their mean's bootstrap is a binomial variable's, of
  // variance (1 − 0.25)/24, and |mean| >= 0.5 is a matter of 2.8 standard deviations.
  Eigen::VectorXd better = Eigen::VectorXd::Zero(kBlocks), worse = better;
  for (Eigen::Index b = 0; b < kBlocks; ++b) {
    worse[b] = b % 4 == 0 ? -1.0 : 1.0;
  }
  const double p = model_confidence_set({worse, better}, {.resamples = 40000})[0];
  // P(X >= 24) + P(X <= 12) for X ~ B(24, 3/4), X = 18 being the mean 0.5.
  double tail = 0.0;
  for (int x = 0; x <= 24; ++x) {
    const double binomial = std::exp(std::lgamma(25.0) - std::lgamma(x + 1.0) - std::lgamma(25.0 - x) +
                                     x * std::log(0.75) + (24 - x) * std::log(0.25));
    tail += x >= 24 || x <= 12 ? binomial : 0.0;
  }
  EXPECT_NEAR(p, tail, 4.0 * std::sqrt(tail / 40000.0));
}

TEST(ConfidenceSet, TheMarginIsALossThatCostsNothing) {
  std::mt19937_64 generator(3);
  std::vector<Eigen::VectorXd> losses = random_losses(2, generator);
  losses[1] = losses[0];
  losses[1].array() += 1.5;
  losses[1][0] += 1e-3;
  EXPECT_LT(model_confidence_set(losses, {.margin = 1.4})[1], kLevel);
  EXPECT_EQ(model_confidence_set(losses, {.margin = 1.6})[1], 1.0);
  double before = 0.0;
  for (const double margin : {0.0, 0.5, 1.0, 1.5, 2.0}) {
    losses[1][0] = losses[0][0] + 8.0;
    const double p = model_confidence_set(losses, {.margin = margin})[1];
    EXPECT_GE(p, before);
    before = p;
  }
}

TEST(ConfidenceSet, EqualLossesAreEquallyGood) {
  std::mt19937_64 generator(4);
  std::vector<Eigen::VectorXd> losses = random_losses(1, generator);
  losses.push_back(losses[0]);
  losses.push_back(losses[0]);
  losses.back().array() += 5.0;
  const std::vector<double> p = model_confidence_set(losses);
  EXPECT_EQ(p[0], 1.0);
  EXPECT_EQ(p[1], 1.0);
  EXPECT_LT(p[2], kLevel);
}

TEST(ConfidenceSet, NeedsBlocksOfEveryModel) {
  const Eigen::VectorXd four = Eigen::VectorXd::Ones(4);
  EXPECT_THROW((void)model_confidence_set({}), InvalidArgument);
  EXPECT_THROW((void)model_confidence_set({Eigen::VectorXd::Ones(3)}), InvalidArgument);
  EXPECT_THROW((void)model_confidence_set({four, Eigen::VectorXd::Ones(5)}), InvalidArgument);
  EXPECT_THROW((void)model_confidence_set({four, four * std::numeric_limits<double>::quiet_NaN()}), InvalidArgument);
  EXPECT_THROW((void)model_confidence_set({four}, {.resamples = 0}), InvalidArgument);
  EXPECT_EQ(model_confidence_set({four}), std::vector<double>{1.0});
}

}  // namespace
}  // namespace wheelwright::gap::confidence_set_test

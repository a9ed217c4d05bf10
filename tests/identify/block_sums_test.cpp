// SPDX-License-Identifier: Apache-2.0
#include <bit>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "identify/moments.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::identify::block_sums_test {
namespace {

using testing_support::Autoregression;
using testing_support::Random;

TEST(BlockSums, AreBoundedAndExact) {
  constexpr std::size_t kept = 16;
  Random random(1);
  BlockSums sums(2, kept);
  std::vector<Eigen::Vector2d> values;
  for (std::size_t k = 0; k < 5000; ++k) {
    // Whole numbers: their sums have no rounding.
    values.emplace_back(static_cast<double>(random.below(1000)), -static_cast<double>(random.below(7)));
    sums.add(values.back());
    const std::size_t length = sums.block_length();
    const auto blocks = static_cast<std::size_t>(sums.blocks().cols());
    ASSERT_EQ(sums.count(), values.size());
    ASSERT_TRUE(std::has_single_bit(length));
    ASSERT_LE(blocks, 2 * kept);
    ASSERT_EQ(blocks, values.size() / length);
    if (values.size() >= kept) {
      ASSERT_GE(blocks, kept);
    }
    if (k % 97 != 0) {
      continue;
    }
    for (std::size_t b = 0; b < blocks; ++b) {
      Eigen::Vector2d sum = Eigen::Vector2d::Zero();
      for (std::size_t i = b * length; i < (b + 1) * length; ++i) {
        sum += values[i];
      }
      ASSERT_EQ(Eigen::Vector2d(sums.blocks().col(static_cast<Eigen::Index>(b))), sum);
    }
  }
}

TEST(BlockSums, MisuseIsRefused) {
  EXPECT_THROW(BlockSums(0), InvalidArgument);
  EXPECT_THROW(BlockSums(1, 7), InvalidArgument);
}

// Mean over seeds of the estimated variance of the sum of `count` values, over the true one.
struct Average {
  double ratio = 0.0;
  double freedom = 0.0;
};

Average average_ratio(double phi, std::size_t count, double true_variance) {
  constexpr std::uint64_t runs = 400;
  Average mean;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    Autoregression noise(seed, phi);
    BlockSums sums(1);
    for (std::size_t k = 0; k < count; ++k) {
      sums.add(Eigen::VectorXd::Constant(1, noise.next()));
    }
    const LongRunCovariance found = long_run_covariance(sums);
    mean.ratio += found.matrix(0, 0) / true_variance / static_cast<double>(runs);
    mean.freedom = found.freedom;
  }
  return mean;
}

// Variance of the sum of N stationary values of unit variance and correlation φ^|lag|.
double variance_of_sum(double phi, double count) {
  return count * (1.0 + phi) / (1.0 - phi) - 2.0 * phi * (1.0 - std::pow(phi, count)) / ((1.0 - phi) * (1.0 - phi));
}

TEST(LongRunCovariance, IsUnbiasedForWhiteNoise) {
  // The estimate is χ²_B/B of the truth: four standard deviations of the mean of 400 such.
  const Average mean = average_ratio(0.0, 4000, 4000.0);
  EXPECT_NEAR(mean.ratio, 1.0, 4.0 * std::sqrt(2.0 / mean.freedom / 400.0));
}

TEST(LongRunCovariance, KnowsAutocorrelatedNoise) {
  // The spectrum of AR(1) falls with frequency: at the B-th cosine, ω = πB/N, by (1 − φ)²/|1 − φe^{iω}|².
  for (const double phi : {0.5, 0.9, 0.98}) {
    constexpr double count = 20000.0;
    const Average mean = average_ratio(phi, static_cast<std::size_t>(count), variance_of_sum(phi, count));
    double spectrum = 0.0;
    for (double f = 1.0; f <= mean.freedom; f += 1.0) {
      const double omega = std::numbers::pi * f / count;
      spectrum += (1.0 - phi) * (1.0 - phi) / (1.0 - 2.0 * phi * std::cos(omega) + phi * phi) / mean.freedom;
    }
    EXPECT_NEAR(mean.ratio, spectrum, 4.0 * std::sqrt(2.0 / mean.freedom / 400.0) + 0.01) << "phi " << phi;
  }
}

TEST(LongRunCovariance, OfSeveralSeriesIsThatOfTheirCombinations) {
  Random random(5);
  BlockSums both(2), combined(1);
  for (int k = 0; k < 3000; ++k) {
    const Eigen::Vector2d value(random.normal(), random.normal());
    both.add(value);
    combined.add(Eigen::VectorXd::Constant(1, 3.0 * value[0] - 2.0 * value[1]));
  }
  const Eigen::Vector2d c(3.0, -2.0);
  const Eigen::MatrixXd matrix = long_run_covariance(both).matrix;
  EXPECT_EQ(matrix, matrix.transpose());
  const double expected = long_run_covariance(combined).matrix(0, 0);
  EXPECT_NEAR(c.dot(matrix * c), expected, 1e-11 * expected);
}

// 2E²/var of the variance that is found, over many series of white Gaussian noise of the given sizes.
double freedom_by_trial(const std::vector<double>& sizes) {
  constexpr int runs = 20000;
  double sum = 0.0, squares = 0.0;
  Random random(17);
  for (int run = 0; run < runs; ++run) {
    BlockSums series(1);
    for (const double size : sizes) {
      series.add(Eigen::VectorXd::Constant(1, size * random.normal()));
    }
    const double variance = long_run_covariance(series).matrix(0, 0);
    sum += variance;
    squares += variance * variance;
  }
  const double mean = sum / runs;
  return 2.0 * mean * mean / (squares / runs - mean * mean);
}

TEST(LongRunCovariance, FreedomIsThatOfTheStretchesThatCount) {
  std::vector<double> even(100, 1.0), once(100, 0.0), drive(100, 0.1);
  for (std::size_t k = 0; k < 100; ++k) {
    once[k] = k >= 50 && k < 53 ? 1.0 : 0.0;
    drive[k] = k % 25 < 5 ? 1.0 : 0.1;
  }
  const auto told = [](const std::vector<double>& sizes) {
    BlockSums squares(1);
    for (const double size : sizes) {
      squares.add(Eigen::VectorXd::Constant(1, size * size));
    }
    return effective_freedom(squares.blocks().row(0), static_cast<std::size_t>(long_run_covariance(squares).freedom));
  };
  BlockSums series(1);
  for (const double size : even) {
    series.add(Eigen::VectorXd::Constant(1, size));
  }
  EXPECT_NEAR(told(even), long_run_covariance(series).freedom, 1e-9);
  EXPECT_LT(told(once), 1.2);
  for (const std::vector<double>& sizes : {even, once, drive}) {
    EXPECT_NEAR(told(sizes), freedom_by_trial(sizes), 0.05 * told(sizes));
  }
}

TEST(LongRunCovariance, TooFewValuesGiveNoCovariance) {
  BlockSums sums(1);
  sums.add(Eigen::VectorXd::Constant(1, 3.0));
  EXPECT_EQ(long_run_covariance(sums).matrix(0, 0), 0.0);
  EXPECT_EQ(long_run_covariance(sums).freedom, 0.0);
}

}  // namespace
}  // namespace wheelwright::identify::block_sums_test

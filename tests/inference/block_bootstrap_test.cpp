// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/block_bootstrap.hpp"

#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "core/error.hpp"
#include "identify/noise_level.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::inference::block_bootstrap_test {
namespace {

using testing_support::Autoregression;
using testing_support::block_of;
using testing_support::Random;

const Eigen::Vector2d kTheta(1.0, -2.0);

identify::RegressionMoments driven(std::uint64_t seed, Eigen::Index instants, double phi) {
  Autoregression motion(9000 + seed, 0.95), error(100 + seed, phi);
  Eigen::MatrixXd Y(instants, 2);
  Eigen::VectorXd y(instants);
  for (Eigen::Index k = 0; k < instants; ++k) {
    Y.row(k) << motion.next(), 1.0;
    y[k] = Y.row(k) * kTheta + error.next();
  }
  identify::RegressionMoments moments(1, 2);
  moments.add(block_of(Y, y, 1));
  return moments;
}

// 250 runs × 2 parameters are binomial with a standard deviation of 1.0 % of the share at 0.95. The method is
// asymptotic: at 4000 instants of correlation 0.9, which are worth 210 independent ones, 93 % are expected.
TEST(BlockBootstrap, CoversUnderAutocorrelatedErrors) {
  constexpr int runs = 250;
  int covered = 0;
  double variance = 0.0;  // of the second parameter, a mean
  for (int run = 0; run < runs; ++run) {
    BlockBootstrapOptions options;
    options.resamples = 300;
    options.seed = static_cast<std::uint64_t>(run);
    const BlockBootstrap b = block_bootstrap(driven(static_cast<std::uint64_t>(run), 4000, 0.9), options);
    ASSERT_TRUE(b.usable);
    variance += b.standard_error[1] * b.standard_error[1] / runs;
    for (Eigen::Index j = 0; j < 2; ++j) {
      covered += b.lower[j] <= kTheta[j] && kTheta[j] <= b.upper[j] ? 1 : 0;
    }
  }
  const double share = covered / (2.0 * runs);
  EXPECT_GE(share, 0.90);
  EXPECT_LE(share, 0.98);
  // A mean of N values has the variance (1 + φ)/(1 − φ)/N. Without allowing for their edges stretches miss 16 % of it,
  // of which the mean's own removal takes some 4 %.
  EXPECT_NEAR(variance, 19.0 / 4000.0, 0.08 * 19.0 / 4000.0);
}

// White errors of variance 1: standard errors are the classical ones, (YᵀY)⁻¹, and intervals those of Student's t with
// many degrees of freedom. A bootstrap quantile of 4000 draws is known to about 2 %, a standard error of 2000 blocks to
// 1.6 %.
TEST(BlockBootstrap, AgreesWithStudentForManyIndependentErrors) {
  const identify::RegressionMoments moments = driven(3, 8000, 0.0);
  BlockBootstrapOptions options;
  options.resamples = 4000;
  const BlockBootstrap b = block_bootstrap(moments, options);
  ASSERT_TRUE(b.usable);
  const Eigen::MatrixXd covariance = moments.total(Eigen::VectorXd::Ones(1)).YY.inverse();
  for (Eigen::Index j = 0; j < 2; ++j) {
    const double classical = std::sqrt(covariance(j, j));
    EXPECT_NEAR(b.standard_error[j], classical, 0.1 * classical);
    EXPECT_NEAR(b.upper[j] - b.lower[j], 2.0 * 1.96 * classical, 0.12 * 2.0 * 1.96 * classical);
    EXPECT_NEAR(b.percentile_upper[j] - b.percentile_lower[j], 2.0 * 1.96 * classical, 0.12 * 2.0 * 1.96 * classical);
  }
}

TEST(BlockBootstrap, IsTheSameForTheSameSeed) {
  const identify::RegressionMoments moments = driven(4, 1000, 0.5);
  BlockBootstrapOptions options;
  options.resamples = 50;
  options.seed = 17;
  const BlockBootstrap first = block_bootstrap(moments, options);
  const BlockBootstrap second = block_bootstrap(moments, options);
  EXPECT_EQ(first.seed, 17U);
  EXPECT_EQ(first.lower, second.lower);
  EXPECT_EQ(first.percentile_upper, second.percentile_upper);
  options.seed = 18;
  EXPECT_NE(first.lower, block_bootstrap(moments, options).lower);
}

TEST(BlockBootstrap, OfExactRowsIsOnePoint) {
  Random random(5);
  const Eigen::MatrixXd Y = random.matrix(400, 2);
  identify::RegressionMoments moments(1, 2);
  moments.add(block_of(Y, Y * kTheta, 1));
  BlockBootstrapOptions options;
  options.resamples = 50;
  const BlockBootstrap b = block_bootstrap(moments, options);
  ASSERT_TRUE(b.usable);
  EXPECT_LE((b.percentile_lower - kTheta).norm(), 1e-12);
  EXPECT_LE((b.percentile_upper - kTheta).norm(), 1e-12);
}

TEST(BlockBootstrap, SaysWhenItCannotBeHad) {
  BlockBootstrapOptions options;
  options.seconds = 5.0;
  const BlockBootstrap b = block_bootstrap(driven(6, 1000, 0.5), options);  // ten seconds: two stretches
  EXPECT_FALSE(b.usable);
  EXPECT_FALSE(b.reason.empty());
  options.resamples = 3;
  EXPECT_THROW((void)block_bootstrap(driven(6, 1000, 0.5), options), InvalidArgument);
}

// AR(1) with correlation φ: R(0) = 1, Σ R = (1 + φ)/(1 − φ), Σ|k|R = 2φ/(1 − φ)².
TEST(BlockLength, KnowsTheMemoryOfAnAutoregression) {
  for (const double phi : {0.5, 0.8}) {
    Autoregression error(7, phi);
    const Eigen::VectorXd series = Eigen::VectorXd::NullaryExpr(200000, [&] { return error.next(); });
    const SeriesMemory memory = series_memory(series);
    EXPECT_NEAR(memory.variance, 1.0, 0.03);
    EXPECT_NEAR(memory.long_run, (1.0 + phi) / (1.0 - phi), 0.1 * (1.0 + phi) / (1.0 - phi));
    EXPECT_NEAR(memory.weighted, 2.0 * phi / std::pow(1.0 - phi, 2), 0.25 * 2.0 * phi / std::pow(1.0 - phi, 2));
    const double ratio = 2.0 * phi / (1.0 - phi * phi);
    const double length = std::cbrt(1.5 * ratio * ratio * 200000.0);
    EXPECT_NEAR(static_cast<double>(bootstrap_block_length(series.transpose())), length, 0.25 * length);
    EXPECT_NEAR(edge_share(series.transpose(), 100), ratio / 100.0, 0.25 * ratio / 100.0);
  }
}

TEST(BlockLength, IsOneForIndependentValues) {
  Random random(8);
  Eigen::MatrixXd series = Eigen::MatrixXd::NullaryExpr(1, 100000, [&] { return random.normal(); });
  EXPECT_EQ(series_memory(series.row(0).transpose()).lags, 0U);
  EXPECT_EQ(bootstrap_block_length(series), 1U);
  EXPECT_EQ(sign_group_length(series, 0.05, 24), 1U);
  EXPECT_EQ(bootstrap_block_length(Eigen::MatrixXd::Zero(2, 50)), 1U);
}

}  // namespace
}  // namespace wheelwright::inference::block_bootstrap_test

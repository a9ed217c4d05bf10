// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/statistics.hpp"
#include "identify/least_squares.hpp"
#include "identify/noise_level.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::identify::residual_statistics_test {
namespace {

using testing_support::Autoregression;
using testing_support::block_of;
using testing_support::Random;

TEST(ResidualStatistics, AreThoseOfTheRows) {
  Random random(3);
  const Eigen::MatrixXd Y = random.matrix(800, 2);
  const Eigen::Vector2d theta(1.0, -2.0);
  Eigen::VectorXd e(800);
  for (Eigen::Index i = 0; i < 800; ++i) {
    e[i] = (i % 2 == 0 ? 1.0 : 0.1) * random.normal();
  }
  const Eigen::VectorXd y = Y * theta + e;
  ResidualStatistics statistics(theta, Eigen::Vector2d(1.0, 10.0));
  const RegressionBlock block = block_of(Y, y, 2);
  statistics.add(block, 0, 100);
  statistics.add(block, 100);
  const ResidualSummary s = statistics.summary(Eigen::Matrix2d::Identity());
  ASSERT_EQ(s.outputs.size(), 2u);
  EXPECT_EQ(s.instants, 400u);
  for (Eigen::Index i = 0; i < 2; ++i) {
    const Eigen::ArrayXd r = (y - Y * theta)(Eigen::seqN(i, 400, 2)).array();
    const OutputResidual& o = s.outputs[static_cast<std::size_t>(i)];
    Eigen::Index at = 0;
    EXPECT_NEAR(o.largest, r.abs().maxCoeff(&at), 1e-14);
    EXPECT_EQ(o.largest_sample, static_cast<std::size_t>(at));
    EXPECT_EQ(o.largest_time, block.t[static_cast<std::size_t>(at)]);
    EXPECT_NEAR(o.rms, std::sqrt(r.square().mean()), 1e-12 * o.rms);
    EXPECT_NEAR(o.kurtosis, r.square().square().mean() / std::pow(r.square().mean(), 2), 1e-10);
    EXPECT_NEAR(o.torque_rms, y(Eigen::seqN(i, 400, 2)).norm() / 20.0, 1e-12 * o.torque_rms);
    EXPECT_LE(o.effective_instants, 400.0);
    EXPECT_GE(o.effective_instants, 4.0);
  }
}

// A column that is seen in 30 rows of 3000 only: what the fit leaves of the noise there says less than all the rest.
TEST(ResidualStatistics, StationaryCovarianceIsThatOfAColumnSeenOnce) {
  constexpr double phi = 0.9;
  constexpr int runs = 400;
  double squares = 0.0, stationary = 0.0, seen = 0.0;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    Autoregression noise(seed, phi);
    const Eigen::MatrixXd Y = Eigen::MatrixXd::NullaryExpr(
        3000, 1, [](Eigen::Index k, Eigen::Index) { return k >= 1500 && k < 1530 ? 1.0 : 0.0; });
    const Eigen::VectorXd e = Eigen::VectorXd::NullaryExpr(3000, [&] { return noise.next(); });
    core::RegressionTable table(block_of(Y, Y + e, 1));
    const LeastSquaresFit fit = least_squares(table);
    ResidualStatistics statistics(fit.estimate, Eigen::VectorXd::Ones(1));
    statistics.add(table.block());
    const ResidualSummary s = statistics.summary(fit.inverse_gram);
    squares += std::pow(fit.estimate[0] - 1.0, 2) / runs;
    stationary += s.stationary_covariance(0, 0) / runs;
    seen += s.covariance(0, 0) / runs;
  }
  // The mean of n values: (1 + φ)/(1 − φ) σ²/n for many, less for 30.
  EXPECT_GT(stationary, squares);
  EXPECT_LT(stationary, 1.6 * squares);
  EXPECT_LT(seen, 0.5 * squares);
}

// Squares of AR(1) noise have the correlation φ^(2 lag): N (1 − φ²)/(1 + φ²) values know the variance as well as N
// independent ones.
TEST(ResidualStatistics, EffectiveInstantsAreThoseOfTheSquares) {
  constexpr double phi = 0.9;
  constexpr Eigen::Index count = 20000;
  double mean_variance = 0.0;
  constexpr int runs = 100;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    Autoregression noise(seed, phi);
    const Eigen::VectorXd y = Eigen::VectorXd::NullaryExpr(count, [&] { return noise.next(); });
    ResidualStatistics statistics(Eigen::VectorXd::Zero(1), Eigen::VectorXd::Ones(1));
    statistics.add(block_of(Eigen::MatrixXd::Ones(count, 1), y, 1));
    mean_variance += 1.0 / statistics.summary(Eigen::MatrixXd::Identity(1, 1)).outputs[0].effective_instants / runs;
  }
  const double expected = (1.0 + phi * phi) / (1.0 - phi * phi) / static_cast<double>(count);
  EXPECT_NEAR(mean_variance / expected, 1.0, 0.12);
}

// A drive of 60 s at 200 Hz: slow columns as a robot makes them, residuals with a memory of a quarter of a second.
Eigen::MatrixXd slow_columns(Eigen::Index count) {
  return Eigen::MatrixXd::NullaryExpr(count, 4, [](Eigen::Index k, Eigen::Index j) {
    const double t = 0.005 * static_cast<double>(k), f = 0.5 + 0.7 * static_cast<double>(j);
    return std::sin(f * t) + 0.5 * std::cos(2.3 * f * t) + (j == 3 ? 1.0 : 0.0);
  });
}

TEST(Covariance, IsHonestUnderAutocorrelatedResiduals) {
  constexpr Eigen::Index count = 12000;
  constexpr int runs = 400;
  const Eigen::MatrixXd Y = slow_columns(count);
  const Eigen::Vector4d truth(2.0, 0.1, 0.5, -1.0);
  Eigen::Array4i covered = Eigen::Array4i::Zero();
  Eigen::Array4i covered_if_white = Eigen::Array4i::Zero();
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    Autoregression noise(seed, 0.98);
    const Eigen::VectorXd e = Eigen::VectorXd::NullaryExpr(count, [&] { return 0.3 * noise.next(); });
    core::RegressionTable table(block_of(Y, Y * truth + e, 1));
    const LeastSquaresFit fit = least_squares(table);
    ResidualStatistics statistics(fit.estimate, Eigen::VectorXd::Ones(1));
    statistics.add(table.block());
    const ResidualSummary s = statistics.summary(fit.inverse_gram);
    const double t = core::student_quantile(0.95, s.freedom);
    const Eigen::Array4d error = (fit.estimate - truth).array().abs();
    covered += (error <= t * s.standard_error.array()).cast<int>();
    const Eigen::Array4d white = (fit.inverse_gram.diagonal() * fit.weighted_rss / count).cwiseSqrt();
    covered_if_white += (error <= 1.96 * white).cast<int>();
  }
  for (Eigen::Index j = 0; j < 4; ++j) {
    EXPECT_GE(covered[j], runs * 90 / 100) << "parameter " << j;
    EXPECT_LE(covered[j], runs * 98 / 100) << "parameter " << j;
    // The noise is such that the textbook covariance would not be: the test can fail.
    EXPECT_LT(covered_if_white[j], runs / 2) << "parameter " << j;
  }
}

}  // namespace
}  // namespace wheelwright::identify::residual_statistics_test

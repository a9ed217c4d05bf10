// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <functional>
#include <numbers>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "core/statistics.hpp"
#include "identify/least_squares.hpp"
#include "identify/noise_level.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::identify::noise_level_test {
namespace {

using testing_support::Autoregression;
using testing_support::block_of;
using testing_support::Random;

constexpr int kPairs = 1000;

struct Log {
  OutputResidual residual;
  std::size_t instants = 0;
};

Log log_of(Eigen::Index count, const std::function<double()>& noise) {
  ResidualStatistics statistics(Eigen::VectorXd::Zero(1), Eigen::VectorXd::Ones(1));
  statistics.add(
      block_of(Eigen::MatrixXd::Zero(count, 1), Eigen::VectorXd::NullaryExpr(count, [&] { return noise(); }), 1));
  const ResidualSummary s = statistics.summary(Eigen::MatrixXd::Identity(1, 1));
  return {s.outputs[0], s.instants};
}

struct Tally {
  int exceeded = 0;
  int heavy = 0;
};

// How often the second log of a pair exceeds the bound made from the first.
Tally pairs(Eigen::Index count, const ExtrapolationOptions& options,
            const std::function<std::function<double()>(std::uint64_t)>& make) {
  Tally tally;
  for (std::uint64_t pair = 0; pair < kPairs; ++pair) {
    const Log first = log_of(count, make(2 * pair + 1));
    const Log second = log_of(count, make(2 * pair + 2));
    const ExtrapolatedBound bound = extrapolate(first.residual, first.instants, options);
    tally.exceeded += second.residual.largest > bound.bound ? 1 : 0;
    tally.heavy += bound.heavy_tail ? 1 : 0;
  }
  return tally;
}

auto autoregression(double phi) {
  return [phi](std::uint64_t seed) -> std::function<double()> {
    return [noise = Autoregression(seed, phi)]() mutable { return 0.7 * noise.next(); };
  };
}

auto laplace(std::uint64_t seed) -> std::function<double()> {
  return [random = Random(seed)]() mutable { return random.laplace(); };
}

// Student's t with three degrees of freedom: P(|e| > x) falls with x⁻³ only.
auto student(std::uint64_t seed) -> std::function<double()> {
  return [random = Random(seed)]() mutable {
    const double z = random.normal(), a = random.normal(), b = random.normal(), c = random.normal();
    return z / std::sqrt((a * a + b * b + c * c) / 3.0);
  };
}

// Among 1,000 pairs a risk of 1 % gives 10 exceedances, and more than 3 times that with probability 1e-7.
TEST(Extrapolation, CoversTheNextLogOfWhiteNoise) {
  const Tally tally = pairs(1000, {.risk = 0.01}, autoregression(0.0));
  EXPECT_LE(tally.exceeded, 30);
  EXPECT_LE(tally.heavy, 30);
}

TEST(Extrapolation, CoversTheNextLogOfAutocorrelatedNoise) {
  for (const double phi : {0.9, 0.98}) {
    const Tally tally = pairs(1000, {.risk = 0.01}, autoregression(phi));
    EXPECT_LE(tally.exceeded, 30) << "phi " << phi;
    EXPECT_LE(tally.heavy, 30) << "phi " << phi;
  }
}

TEST(Extrapolation, FlagsHeavyTails) { EXPECT_GE(pairs(1000, {.risk = 0.01}, student).heavy, kPairs * 99 / 100); }

// Tails that fall exponentially are what the second formula is made for.
TEST(Extrapolation, CoversTheNextLogOfExponentialTails) {
  const Tally tally = pairs(1000, {.risk = 0.01}, laplace);
  EXPECT_GE(tally.heavy, kPairs * 99 / 100);
  EXPECT_LE(tally.exceeded, 30);
}

TEST(Extrapolation, ALongerHorizonAndASmallerRiskNeedALargerBound) {
  const Log log = log_of(2000, autoregression(0.5)(1));
  const auto bound = [&](double risk, double horizon) {
    return extrapolate(log.residual, log.instants, {.risk = risk, .horizon = horizon}).bound;
  };
  EXPECT_LT(bound(0.01, 1.0), bound(0.001, 1.0));
  EXPECT_LT(bound(0.01, 1.0), bound(0.01, 100.0));
  EXPECT_GT(bound(0.01, 1.0), log.residual.rms);
  // Units carry over.
  Log scaled = log;
  scaled.residual.rms *= 8.0;
  scaled.residual.largest *= 8.0;
  EXPECT_DOUBLE_EQ(extrapolate(scaled.residual, log.instants, {.risk = 0.01}).bound, 8.0 * bound(0.01, 1.0));
}

TEST(Extrapolation, ManyInstantsReachTheGaussianQuantile) {
  // With the variance known, two sides of N instants share the risk: P(|e| > z) = risk/N. z(1e-3/1e6) = 6.1094.
  const OutputResidual residual{.rms = 1.0, .largest = 5.0, .effective_instants = 1e12};
  EXPECT_NEAR(extrapolate(residual, 1000000, {.risk = 1e-3}).bound, 6.1094, 2e-4);
}

TEST(Extrapolation, MisuseIsRefused) {
  const OutputResidual residual{.rms = 1.0, .largest = 3.0, .effective_instants = 100.0};
  EXPECT_THROW(static_cast<void>(extrapolate(residual, 0)), InvalidArgument);
  EXPECT_THROW(static_cast<void>(extrapolate(residual, 100, {.risk = 0.0})), InvalidArgument);
  EXPECT_THROW(static_cast<void>(extrapolate(residual, 100, {.risk = 1.0})), InvalidArgument);
  EXPECT_THROW(static_cast<void>(extrapolate(residual, 100, {.horizon = std::nan("")})), InvalidArgument);
}

// Gaussian noise, white or autocorrelated, on a fit of three parameters.
TEST(LargestPlausibleError, CoversTheTrueOne) {
  constexpr Eigen::Index count = 1500;
  constexpr int runs = 1000;
  for (const double phi : {0.0, 0.9}) {
    int covered = 0;
    for (std::uint64_t seed = 1; seed <= runs; ++seed) {
      Autoregression noise(seed, phi);
      const Eigen::MatrixXd Y = Eigen::MatrixXd::NullaryExpr(count, 3, [](Eigen::Index k, Eigen::Index j) {
        return std::sin(0.01 * static_cast<double>((j + 1) * k)) + (j == 2 ? 0.5 : 0.0);
      });
      const Eigen::VectorXd e = Eigen::VectorXd::NullaryExpr(count, [&] { return noise.next(); });
      core::RegressionTable table(block_of(Y, Y * Eigen::Vector3d(1.0, 2.0, 3.0) + e, 1));
      const LeastSquaresFit fit = least_squares(table);
      ResidualStatistics statistics(fit.estimate, Eigen::VectorXd::Ones(1));
      statistics.add(table.block());
      const ResidualSummary summary = statistics.summary(fit.inverse_gram);
      const double plausible = largest_plausible_error(table, fit.estimate, summary, 0.01)[0];
      covered += plausible >= e.cwiseAbs().maxCoeff() ? 1 : 0;
      EXPECT_GE(plausible, summary.outputs[0].largest);
    }
    EXPECT_GE(covered, runs * 99 / 100) << "phi " << phi;
  }
}

// One ramp in the log: its column is seen in 20 to 80 rows of 1500, where the fit follows the noise.
TEST(LargestPlausibleError, CoversTheTrueOneWhereAColumnIsSeenOnce) {
  constexpr Eigen::Index count = 1500;
  constexpr int runs = 1000;
  for (const double phi : {0.0, 0.9, 0.97}) {
    for (const double length : {20.0, 80.0}) {
      int covered = 0;
      for (std::uint64_t seed = 1; seed <= runs; ++seed) {
        Autoregression noise(seed, phi);
        const Eigen::MatrixXd Y = Eigen::MatrixXd::NullaryExpr(count, 2, [&](Eigen::Index k, Eigen::Index j) {
          const double at = (static_cast<double>(k) - 700.0) / length;
          return j == 0 ? 1.0 : at > 0.0 && at < 1.0 ? std::sin(std::numbers::pi * at) : 0.0;
        });
        const Eigen::VectorXd e = Eigen::VectorXd::NullaryExpr(count, [&] { return noise.next(); });
        core::RegressionTable table(block_of(Y, Y * Eigen::Vector2d(1.0, 20.0) + e, 1));
        const LeastSquaresFit fit = least_squares(table);
        ResidualStatistics statistics(fit.estimate, Eigen::VectorXd::Ones(1));
        statistics.add(table.block());
        const double plausible =
            largest_plausible_error(table, fit.estimate, statistics.summary(fit.inverse_gram), 0.01)[0];
        covered += plausible >= e.cwiseAbs().maxCoeff() ? 1 : 0;
      }
      EXPECT_GE(covered, runs * 99 / 100) << "phi " << phi << ", " << length << " rows";
    }
  }
}

TEST(StudentQuantile, IsThatOfTheTables) {
  // Abramowitz and Stegun 1964, table 26.10.
  EXPECT_NEAR(core::student_quantile(0.95, 1.0), 12.706, 5e-4);
  EXPECT_NEAR(core::student_quantile(0.95, 24.0), 2.064, 5e-4);
  EXPECT_NEAR(core::student_quantile(0.99, 10.0), 3.169, 5e-4);
  EXPECT_THROW(static_cast<void>(core::student_quantile(1.0, 3.0)), InvalidArgument);
  EXPECT_THROW(static_cast<void>(core::student_quantile(0.9, 0.0)), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::identify::noise_level_test

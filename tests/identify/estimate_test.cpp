// SPDX-License-Identifier: Apache-2.0
#include "identify/estimate.hpp"
#include "core/statistics.hpp"

#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/QR>
#include <Eigen/SVD>

#include "identify/least_squares.hpp"
#include "identify/noise_level.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::identify::estimate_test {
namespace {

using testing_support::block_of;
using testing_support::Random;

// Exact regressor X, measured one Y = X + noise, y = Xθ + noise, instruments that share X but no noise.
struct World {
  Eigen::MatrixXd X, Y, Z;
  Eigen::VectorXd y, theta;

  [[nodiscard]] RegressionMoments moments(const Eigen::MatrixXd& instruments) const {
    RegressionMoments sums(1, static_cast<std::size_t>(Y.cols()), true, 128);
    Eigen::MatrixXd both(Y.rows(), 2 * Y.cols());
    both << Y, instruments;
    sums.add(block_of(both, y, 1));
    return sums;
  }
};

World world(std::uint64_t seed, Eigen::Index rows, double noise_of_Y, double noise_of_y) {
  Random random(seed);
  const auto normal = [&](Eigen::Index r, Eigen::Index c) -> Eigen::MatrixXd {
    return Eigen::MatrixXd::NullaryExpr(r, c, [&] { return random.normal(); });
  };
  World w;
  w.theta = Eigen::Vector3d(2.0, -1.0, 0.5);
  w.X = normal(rows, 3);
  w.Y = w.X + noise_of_Y * normal(rows, 3);
  w.Z = w.X + 0.3 * normal(rows, 3);
  w.y = w.X * w.theta + noise_of_y * normal(rows, 1);
  return w;
}

RowNoise noise_of(double sd_of_Y, double sd_of_y) {
  return {.YY = {sd_of_Y * sd_of_Y * Eigen::MatrixXd::Identity(3, 3)},
          .yy = Eigen::VectorXd::Constant(1, sd_of_y * sd_of_y)};
}

TEST(Estimates, AgreeWithoutNoiseInTheRegressor) {
  const World w = world(1, 500, 0.0, 0.1);
  const RegressionMoments m = w.moments(w.Y);
  const Eigen::VectorXd qr = w.Y.householderQr().solve(w.y);
  const double tolerance = 1e-13;
  EXPECT_LE((ordinary_least_squares(m).theta - qr).norm(), tolerance);
  EXPECT_LE((instrumental_variables(m).theta - qr).norm(), tolerance);
  EXPECT_LE((bias_compensated(m, noise_of(0.0, 0.1)).theta - qr).norm(), tolerance);
  EXPECT_LE((total_least_squares(m, noise_of(0.0, 0.1)).theta - qr).norm(), tolerance);
}

TEST(Estimates, OfInstrumentsSolveTheirEquations) {
  const World w = world(2, 400, 0.5, 0.2);
  const Estimate e = instrumental_variables(w.moments(w.Z));
  EXPECT_LE((w.Z.transpose() * (w.y - w.Y * e.theta)).norm(), 1e-10 * (w.Z.transpose() * w.y).norm());
}

// Classical total least squares: the right singular vector of [Y y] of the smallest singular value.
TEST(Estimates, OfTotalLeastSquaresAreTheSingularVector) {
  const World w = world(3, 300, 0.2, 0.2);
  Eigen::MatrixXd both(300, 4);
  both << w.Y, w.y;
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(both, Eigen::ComputeThinV);
  const Eigen::VectorXd v = svd.matrixV().col(3);
  const Estimate e = total_least_squares(w.moments(w.Z), noise_of(1.0, 1.0));
  EXPECT_LE((e.theta + v.head(3) / v[3]).norm(), 1e-11);
}

TEST(Estimates, LeaveExcludedParametersAtZero) {
  const World w = world(4, 300, 0.1, 0.1);
  const EstimatorOptions options{.weights = {}, .excluded = {false, true, false}};
  Eigen::MatrixXd two(300, 2);
  two << w.Y.col(0), w.Y.col(2);
  const Eigen::VectorXd expected = two.householderQr().solve(w.y);
  const Estimate e = ordinary_least_squares(w.moments(w.Z), options);
  EXPECT_NEAR(e.theta[0], expected[0], 1e-13);
  EXPECT_EQ(e.theta[1], 0.0);
  EXPECT_NEAR(e.theta[2], expected[1], 1e-13);
  EXPECT_EQ(e.standard_error[1], 0.0);
}

TEST(Estimates, SayWhenTheyCannotBeHad) {
  World w = world(5, 300, 0.1, 0.1);
  w.Y.col(1) = 2.0 * w.Y.col(0);
  EXPECT_FALSE(ordinary_least_squares(w.moments(w.Y)).usable);
  EXPECT_FALSE(ordinary_least_squares(w.moments(w.Y)).reason.empty());
  const World noisy = world(6, 300, 5.0, 0.1);
  EXPECT_FALSE(bias_compensated(noisy.moments(noisy.Z), noise_of(5.0, 0.1)).usable);
}

// Where the bias of least squares is many standard errors, the others keep their 95 % intervals: 400 runs × 3
// parameters are binomial with a standard deviation of 0.63 % of the share, 1.1 % if the three depend wholly on one
// another.
TEST(Estimates, CoverTheTruthWhereLeastSquaresDoesNot) {
  constexpr int runs = 400;
  double covered[4] = {};
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();
  for (int run = 0; run < runs; ++run) {
    const World w = world(100 + static_cast<std::uint64_t>(run), 1000, 0.4, 0.3);
    const RegressionMoments m = w.moments(w.Z);
    const Estimate estimates[4] = {ordinary_least_squares(m), instrumental_variables(m),
                                   bias_compensated(m, noise_of(0.4, 0.3)), total_least_squares(m, noise_of(0.4, 0.3))};
    for (int e = 0; e < 4; ++e) {
      ASSERT_TRUE(estimates[e].usable);
      const double t = core::student_quantile(0.95, estimates[e].freedom);
      for (Eigen::Index j = 0; j < 3; ++j) {
        covered[e] += std::abs(estimates[e].theta[j] - w.theta[j]) <= t * estimates[e].standard_error[j] ? 1.0 : 0.0;
      }
    }
    bias += (estimates[0].theta - w.theta) / runs;
  }
  // White noise in every column: attenuated by 1/(1 + 0.16), known to 0.2 %.
  const Eigen::Vector3d expected = -0.16 / 1.16 * Eigen::Vector3d(2.0, -1.0, 0.5);
  EXPECT_LE((bias - expected).cwiseAbs().maxCoeff(), 0.01);
  EXPECT_LT(covered[0] / (3 * runs), 0.5);
  for (int e = 1; e < 4; ++e) {
    EXPECT_NEAR(covered[e] / (3 * runs), 0.95, 3.5 * 0.011) << to_string(static_cast<Estimator>(e));
  }
}

TEST(InstrumentStrength, IsTheSharedPartOfTheVariance) {
  const World w = world(9, 20000, 0.0, 0.1);
  EXPECT_NEAR(instrument_strength(w.moments(w.Y)).minCoeff(), 1.0, 1e-12);
  // Z = X + 0.3 noise explains 1/(1 + 0.09) of X, column by column.
  const Eigen::VectorXd strength = instrument_strength(w.moments(w.Z));
  for (const double s : strength) {
    EXPECT_NEAR(s, 1.0 / 1.09, 0.01);
  }
}

TEST(ContrastTest, RejectsSeldomWithoutNoiseInTheRegressorAndAlwaysWithMuch) {
  constexpr int runs = 600;
  int rejected = 0;
  for (int run = 0; run < runs; ++run) {
    const World w = world(5000 + static_cast<std::uint64_t>(run), 600, 0.0, 0.3);
    const RegressionMoments m = w.moments(w.Z);
    rejected += contrast_test(ordinary_least_squares(m), instrumental_variables(m)).p_value < 0.05 ? 1 : 0;
  }
  // Binomial: 0.05 ± 3.5·0.0089.
  EXPECT_NEAR(rejected / static_cast<double>(runs), 0.05, 3.5 * 0.0089);
  const World noisy = world(8, 600, 0.4, 0.3);
  const RegressionMoments m = noisy.moments(noisy.Z);
  const ContrastTest test = contrast_test(ordinary_least_squares(m), instrumental_variables(m));
  EXPECT_LT(test.p_value, 1e-4);
  EXPECT_GT(test.difference[0], 0.0);
}

TEST(ContrastTest, FindsNothingBetweenEqualEstimates) {
  const World w = world(10, 300, 0.0, 0.1);
  const RegressionMoments m = w.moments(w.Y);
  EXPECT_EQ(contrast_test(ordinary_least_squares(m), instrumental_variables(m)).p_value, 1.0);
}

}  // namespace
}  // namespace wheelwright::identify::estimate_test

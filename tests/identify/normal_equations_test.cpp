// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/identify/normal_equations.hpp>

#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/QR>

#include <wheelwright/core/error.hpp>
#include <wheelwright/identify/least_squares.hpp>

#include "support/random.hpp"
#include "support/rows.hpp"

namespace wheelwright::normal_equations_test {
namespace {

using testing_support::block_of;
using testing_support::Random;

// Columns of sizes 1 to 1000 and a condition number of unit columns of about `condition`.
RegressionBlock rows(std::uint64_t seed, Eigen::Index count, Eigen::Index p, std::size_t n, double condition) {
  Random random(seed);
  Eigen::MatrixXd Y = random.matrix(count, p);
  if (p > 1) {
    Y.col(1) = Y.col(0) + Y.col(1) / condition;
  }
  for (Eigen::Index j = 0; j < p; ++j) {
    Y.col(j) *= std::pow(10.0, static_cast<double>(j % 4));
  }
  const Eigen::VectorXd y = Y * Eigen::VectorXd::Ones(p) + random.matrix(count, 1);
  return block_of(Y, y, n);
}

TEST(NormalEquations, GiveTheDigitsOfQr) {
  for (const Eigen::Index p : {1, 2, 4, 5, 8, 12, 17}) {
    const RegressionBlock block = rows(static_cast<std::uint64_t>(p), 4001, p, 1, 1.0);
    const NormalEquationsFit fit = normal_equations(block);
    ASSERT_EQ(fit.status, NormalEquationsFit::Status::refined);
    const Eigen::VectorXd expected = Eigen::MatrixXd(block.Y).householderQr().solve(block.y);
    for (Eigen::Index j = 0; j < p; ++j) {
      EXPECT_NEAR(fit.estimate[j], expected[j], 1e-12 * std::abs(expected[j])) << "p = " << p;
    }
    const double rss = (block.y - block.Y * expected).squaredNorm();
    EXPECT_NEAR(fit.weighted_rss, rss, 1e-12 * rss);
  }
}

// Without refinement κ² ε is lost; with it κ ε and what rounding of the residual leaves, κ² ε |r|/|Yθ|.
TEST(NormalEquations, GetBackWhatTheyCost) {
  const RegressionBlock block = rows(3, 3000, 4, 1, 1e5);
  RegressionBlock exact = block;
  exact.y = exact.Y * Eigen::Vector4d(1.0, 2.0, -1.0, 0.5);
  const NormalEquationsFit fit = normal_equations(exact);
  ASSERT_EQ(fit.status, NormalEquationsFit::Status::refined);
  EXPECT_GT(fit.condition, 3e4);
  EXPECT_LT(std::abs(fit.estimate[0] - 1.0), 1e-10);
  EXPECT_GT(fit.correction, 1e-9);
}

TEST(NormalEquations, WeighOutputsAndWalkSourcesLikeLeastSquares) {
  RegressionTable table(rows(9, 3000, 3, 2, 1.0));
  const Eigen::Vector2d weights(2.0, 0.1);
  const NormalEquationsFit fit = normal_equations(table, weights);
  const LeastSquaresFit expected = least_squares(table, weights);
  EXPECT_EQ(fit.instants, 1500U);
  EXPECT_LE((fit.estimate - expected.estimate).cwiseQuotient(expected.estimate).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_NEAR(fit.weighted_rss, expected.weighted_rss, 1e-12 * expected.weighted_rss);
}

TEST(NormalEquations, SayWhenQrIsNeeded) {
  EXPECT_EQ(normal_equations(rows(4, 500, 3, 1, 1e9)).status, NormalEquationsFit::Status::ill_conditioned);
  EXPECT_THROW(normal_equations(RegressionTable(RegressionBlock{}).block()), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::normal_equations_test

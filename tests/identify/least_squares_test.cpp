// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/QR>

#include "core/error.hpp"
#include "identify/least_squares.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::identify::least_squares_test {
namespace {

using testing_support::block_of;
using testing_support::Random;

struct Problem {
  Eigen::MatrixXd Y;
  Eigen::VectorXd y;
  std::size_t outputs = 1;

  [[nodiscard]] RegressionBlock block() const { return block_of(Y, y, outputs); }
};

// Columns of sizes from 1 to 1000, noise of a tenth of the signal.
Problem problem(std::uint64_t seed, Eigen::Index rows, Eigen::Index p, std::size_t outputs) {
  Random random(seed);
  Problem a{random.matrix(rows, p), Eigen::VectorXd(), outputs};
  for (Eigen::Index j = 0; j < p; ++j) {
    a.Y.col(j) *= std::pow(10.0, static_cast<double>(j % 4));
  }
  a.y = a.Y * random.matrix(p, 1) + random.matrix(rows, 1);
  return a;
}

Eigen::VectorXd row_weights(const Problem& a, const Eigen::VectorXd& weights) {
  return Eigen::VectorXd::NullaryExpr(
      a.y.size(), [&](Eigen::Index i) { return weights[i % static_cast<Eigen::Index>(a.outputs)]; });
}

// Relative to the size of each value; ε times the condition number of the scaled columns is about 1e-15.
void expect_same(const Eigen::VectorXd& a, const Eigen::VectorXd& b) {
  ASSERT_EQ(a.size(), b.size());
  for (Eigen::Index j = 0; j < a.size(); ++j) {
    EXPECT_NEAR(a[j], b[j], 1e-11 * std::abs(b[j])) << "entry " << j;
  }
}

TEST(LeastSquares, IsThatOfAFactorisationOfTheWholeMatrix) {
  // Around the batch of the sequential factorisation: fewer rows than it holds, exactly as many, several times.
  for (const Eigen::Index rows : {6, 254, 256, 258, 512, 2000}) {
    for (const std::size_t outputs : {std::size_t{1}, std::size_t{2}}) {
      const Problem a = problem(static_cast<std::uint64_t>(rows), rows, 5, outputs);
      core::RegressionTable table(a.block());
      const LeastSquaresFit fit = least_squares(table);
      const Eigen::VectorXd expected = a.Y.colPivHouseholderQr().solve(a.y);
      const double rss = (a.y - a.Y * expected).squaredNorm();
      expect_same(fit.estimate, expected);
      EXPECT_NEAR(fit.weighted_rss, rss, 1e-11 * a.y.squaredNorm());
      EXPECT_NEAR(fit.weighted_tss, a.y.squaredNorm(), 1e-12 * a.y.squaredNorm());
      EXPECT_EQ(fit.instants, static_cast<std::size_t>(rows) / outputs);
      EXPECT_EQ(fit.rank, 5);
    }
  }
}

TEST(LeastSquares, WeightsScaleTheRowsOfTheirOutput) {
  const Problem a = problem(3, 600, 4, 2);
  const Eigen::Vector2d weights(0.25, 40.0);
  const Eigen::VectorXd w = row_weights(a, weights);
  core::RegressionTable table(a.block());
  const LeastSquaresFit fit = least_squares(table, weights);
  const Eigen::MatrixXd scaled = w.asDiagonal() * a.Y;
  const Eigen::VectorXd expected = scaled.householderQr().solve(w.cwiseProduct(a.y));
  expect_same(fit.estimate, expected);
  const Eigen::MatrixXd inverse = (scaled.transpose() * scaled).llt().solve(Eigen::Matrix4d::Identity());
  for (Eigen::Index j = 0; j < 4; ++j) {
    for (Eigen::Index k = 0; k < 4; ++k) {
      EXPECT_NEAR(fit.inverse_gram(j, k), inverse(j, k), 1e-9 * std::sqrt(inverse(j, j) * inverse(k, k)));
    }
  }
  // A common factor of all weights moves nothing but the sums of squares.
  const LeastSquaresFit twice = least_squares(table, 2.0 * weights);
  expect_same(twice.estimate, fit.estimate);
  EXPECT_NEAR(twice.weighted_rss, 4.0 * fit.weighted_rss, 1e-11 * twice.weighted_tss);
}

TEST(LeastSquares, ColumnsAreMeasuredAloneAndBesideTheOthers) {
  const Problem a = problem(11, 500, 3, 1);
  core::RegressionTable table(a.block());
  const LeastSquaresFit fit = least_squares(table);
  const double root = std::sqrt(500.0);
  for (Eigen::Index j = 0; j < 3; ++j) {
    Eigen::MatrixXd others(500, 2);
    others << a.Y.col((j + 1) % 3), a.Y.col((j + 2) % 3);
    const Eigen::VectorXd rest = a.Y.col(j) - others * others.householderQr().solve(a.Y.col(j));
    EXPECT_NEAR(fit.column_rms[j], a.Y.col(j).norm() / root, 1e-12 * fit.column_rms[j]);
    EXPECT_NEAR(fit.partial_rms[j], rest.norm() / root, 1e-11 * fit.column_rms[j]);
  }
}

TEST(LeastSquares, AnsweringHalfOfADoubledColumnEach) {
  Problem a = problem(13, 400, 3, 1);
  a.Y.col(2) = -2.0 * a.Y.col(1);
  core::RegressionTable table(a.block());
  const LeastSquaresFit fit = least_squares(table);
  EXPECT_EQ(fit.rank, 2);
  EXPECT_GT(fit.condition, 1e12);
  EXPECT_LT(fit.partial_rms[1], 1e-12 * fit.column_rms[1]);
  EXPECT_LT(fit.partial_rms[2], 1e-12 * fit.column_rms[2]);
  EXPECT_GT(fit.partial_rms[0], 0.5 * fit.column_rms[0]);
  // What the data determine is the fit without the second copy; of least norm in unit columns, both copies carry as
  // much of it.
  const Eigen::VectorXd expected = a.Y.leftCols(2).householderQr().solve(a.y);
  EXPECT_NEAR(fit.estimate[0], expected[0], 1e-11 * std::abs(expected[0]));
  EXPECT_NEAR(fit.estimate[1], 0.5 * expected[1], 1e-11 * std::abs(expected[1]));
  EXPECT_NEAR(fit.estimate[2], -0.25 * expected[1], 1e-11 * std::abs(expected[1]));
}

TEST(LeastSquares, ExcludedParametersAreZero) {
  const Problem a = problem(17, 400, 3, 1);
  LeastSquares sums(3);
  sums.add(a.block());
  const LeastSquaresFit fit = sums.solve({false, true, false});
  Eigen::MatrixXd rest(400, 2);
  rest << a.Y.col(0), a.Y.col(2);
  const Eigen::VectorXd expected = rest.householderQr().solve(a.y);
  EXPECT_EQ(fit.estimate[1], 0.0);
  EXPECT_NEAR(fit.estimate[0], expected[0], 1e-11 * std::abs(expected[0]));
  EXPECT_NEAR(fit.estimate[2], expected[1], 1e-11 * std::abs(expected[1]));
  EXPECT_NEAR(fit.weighted_rss, (a.y - rest * expected).squaredNorm(), 1e-11 * fit.weighted_tss);
  EXPECT_EQ(fit.rank, 2);
}

TEST(LeastSquares, TheConditionNumberEntersOnce) {
  // Läuchli's matrix (1961): its normal equations are singular in floating point, its columns are not.
  const double small = 1e-9;
  Eigen::MatrixXd Y(3, 2);
  Y << 1.0, 1.0, small, 0.0, 0.0, small;
  const Eigen::Vector2d truth(1.0, 2.0);
  core::RegressionTable table(block_of(Y, Y * truth, 1));
  const LeastSquaresFit fit = least_squares(table);
  EXPECT_EQ(fit.rank, 2);
  EXPECT_NEAR(fit.estimate[0], 1.0, 1e-6);
  EXPECT_NEAR(fit.estimate[1], 2.0, 1e-6);
}

TEST(LeastSquares, MisuseIsRefused) {
  EXPECT_THROW(LeastSquares(0), InvalidArgument);
  EXPECT_THROW(LeastSquares(2, Eigen::Vector2d(1.0, 0.0)), InvalidArgument);
  EXPECT_THROW(LeastSquares(2, Eigen::Vector2d(1.0, std::nan(""))), InvalidArgument);
  EXPECT_THROW(static_cast<void>(LeastSquares(2).solve()), InvalidArgument);
  LeastSquares two(2, Eigen::Vector2d(1.0, 1.0));
  EXPECT_THROW(two.add(problem(1, 10, 3, 2).block()), InvalidArgument);
  EXPECT_THROW(two.add(problem(1, 10, 2, 1).block()), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::identify::least_squares_test

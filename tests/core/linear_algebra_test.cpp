// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include "core/linear_algebra.hpp"

namespace wheelwright::core {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTight = 1e-12;

MatrixXd random_matrix(Index rows, Index columns, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  return MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

MatrixXd hilbert(Index n) {
  return MatrixXd::NullaryExpr(n, n, [](Index i, Index j) { return 1.0 / static_cast<double>(i + j + 1); });
}

// Of order 4, in whole numbers.
MatrixXd hilbert_inverse() {
  return MatrixXd{
      {16, -120, 240, -140}, {-120, 1200, -2700, 1680}, {240, -2700, 6480, -4200}, {-140, 1680, -4200, 2800}};
}

TEST(LinearAlgebra, EigenvaluesOfTheSecondDifference) {
  // 2 − 2 cos(kπ/(n + 1)), k = 1..n
  constexpr Index n = 9;
  MatrixXd second = MatrixXd::Zero(n, n);
  second.diagonal().setConstant(2.0);
  second.diagonal(-1).setConstant(-1.0);  // the upper triangle is not read
  const EigenPairs pairs = symmetric_eigen(second);
  second.diagonal(1).setConstant(-1.0);
  for (Index k = 0; k < n; ++k) {
    EXPECT_NEAR(pairs.values[k], 2.0 - 2.0 * std::cos(static_cast<double>(k + 1) * M_PI / (n + 1)), kTight);
  }
  EXPECT_LT((second * pairs.vectors - pairs.vectors * pairs.values.asDiagonal()).norm(), kTight);
  EXPECT_LT((pairs.vectors.transpose() * pairs.vectors - MatrixXd::Identity(n, n)).norm(), kTight);
}

TEST(LinearAlgebra, PencilsWithoutAPositiveDefiniteSideHaveNoAnswer) {
  const MatrixXd A = hilbert(4), B = MatrixXd{{2, 0, 0, 0}, {0, 3, 0, 0}, {0, 0, 5, 0}, {0, 0, 0, 7}};
  const auto values = generalized_eigenvalues(A, B);
  ASSERT_TRUE(values);
  for (const double value : *values) {
    EXPECT_LT(singular_values(A - value * B).values.minCoeff(), kTight);
  }
  EXPECT_FALSE(generalized_eigenvalues(A, -B));
}

TEST(LinearAlgebra, SingularValues) {
  // Of Hilbert's matrix of order 3: the roots of its characteristic polynomial, 2160 λ³ − 3312 λ² + 381 λ − 1.
  for (const double value : singular_values(hilbert(3)).values) {
    EXPECT_NEAR(((2160.0 * value - 3312.0) * value + 381.0) * value - 1.0, 0.0, 1e-11);
  }
  const MatrixXd wide = random_matrix(3, 5, 1);
  const SingularValues other = singular_values(wide);
  EXPECT_EQ(other.U.rows(), 3);
  EXPECT_EQ(other.V.cols(), 5);
  MatrixXd again = MatrixXd::Zero(3, 5);
  again.diagonal() = other.values;
  EXPECT_LT((other.U * again * other.V.transpose() - wide).norm(), kTight);
}

TEST(LinearAlgebra, InversesOfHilbertsMatrix) {
  const MatrixXd H = hilbert(4), exact = hilbert_inverse();
  const double scale = exact.norm() * kTight * 100;  // its condition number is 1.6e4
  EXPECT_LT((inverse(H) - exact).norm(), scale);
  EXPECT_LT((LuFactors(H).inverse() - exact).norm(), scale);
  EXPECT_LT((RankRevealingLu(H).inverse() - exact).norm(), scale);
  EXPECT_LT((PivotedQr(H).inverse() - exact).norm(), scale);
  EXPECT_LT((pseudo_inverse(H) - exact).norm(), scale);
  EXPECT_LT((LdltFactors(H).solve(MatrixXd(MatrixXd::Identity(4, 4))) - exact).norm(), scale);
  // The condition number in the 1-norm: 25/12 · 13620 = 28375.
  EXPECT_NEAR(LuFactors(H).reciprocal_condition() * 28375.0, 1.0, 1e-9);
  EXPECT_NEAR(RankRevealingLu(H).reciprocal_condition() * 28375.0, 1.0, 1e-9);
  EXPECT_NEAR(LdltFactors(H).reciprocal_condition() * 28375.0, 1.0, 1e-9);
}

TEST(LinearAlgebra, VectorsAreSolvedForByEveryFactorization) {
  const MatrixXd H = hilbert(4);
  const VectorXd x{{1, -2, 3, -4}}, b = H * x;
  for (const VectorXd& solved : {LuFactors(H).solve(b), RankRevealingLu(H).solve(b), LdltFactors(H).solve(b),
                                 CholeskyFactors(H).solve(b), PivotedQr(H).solve(b), least_squares_solution(H, b)}) {
    EXPECT_LT((solved - x).norm(), 1e-9);
  }
}

TEST(LinearAlgebra, FactorsTellWhatIsSingularOrIndefinite) {
  const MatrixXd singular{{1, 2}, {2, 4}}, indefinite{{1, 2}, {2, 1}};
  EXPECT_FALSE(RankRevealingLu(singular).invertible());
  EXPECT_TRUE(RankRevealingLu(indefinite).invertible());
  EXPECT_FALSE(inverse(singular).allFinite());
  EXPECT_TRUE(LdltFactors(singular).positive());
  EXPECT_FALSE(LdltFactors(indefinite).positive());
  EXPECT_FALSE(CholeskyFactors(indefinite).positive());
  EXPECT_TRUE(CholeskyFactors(hilbert(4)).positive());
  EXPECT_EQ(PivotedQr(singular).rank(), 1);
  EXPECT_EQ(PivotedQr(hilbert(4)).rank(), 4);
  EXPECT_EQ(PivotedQr(hilbert(4), 1e-2).rank(), 2);
}

TEST(LinearAlgebra, MinimumNorm) {
  const MatrixXd wide = random_matrix(3, 6, 2), b = random_matrix(3, 1, 3);
  const MatrixXd x = minimum_norm_solution(wide, b);
  EXPECT_LT((wide * x - b).norm(), kTight);
  // Of least norm where it lies in the span of the rows.
  EXPECT_LT((x - wide.transpose() * inverse(wide * wide.transpose()) * b).norm(), kTight);
  EXPECT_LT((pseudo_inverse(wide) * b - x).norm(), kTight);
}

TEST(LinearAlgebra, OrthogonalFactors) {
  const MatrixXd A = random_matrix(7, 4, 4);
  const VectorXd b = random_matrix(7, 1, 5);
  const QrFactors qr(A);
  EXPECT_LT((qr.Q().leftCols(4) * qr.R() - A).norm(), kTight);
  EXPECT_LT((qr.Q().transpose() * qr.Q() - MatrixXd::Identity(7, 7)).norm(), kTight);
  EXPECT_LT((qr.rotate(b) - qr.Q().transpose() * b).norm(), kTight);
  MatrixXd stack = A;
  triangularize(stack);
  EXPECT_EQ(stack.topRows(4), qr.R());
  EXPECT_EQ(stack.bottomRows(3), MatrixXd::Zero(3, 4));

  const PivotedQr pivoted(A);
  MatrixXd sorted(7, 4);
  for (Index k = 0; k < 4; ++k) {
    sorted.col(k) = A.col(pivoted.order()[k]);
  }
  EXPECT_LT((pivoted.Q(4) * pivoted.R(4) - sorted).norm(), kTight);
  EXPECT_LT((pivoted.Q().leftCols(4) - pivoted.Q(4)).norm(), kTight);
  EXPECT_LT((pivoted.rotate_back(pivoted.rotate(b)) - b).norm(), kTight);
  EXPECT_LT((A.transpose() * (A * pivoted.solve(b) - b)).norm(), kTight);
}

TEST(LinearAlgebra, TrianglesDoNotReadTheOtherSide) {
  MatrixXd T = random_matrix(5, 5, 6);
  T.diagonal().array() += 5.0;
  const MatrixXd B = random_matrix(5, 2, 7);
  const MatrixXd upper = T.triangularView<Eigen::Upper>(), lower = T.triangularView<Eigen::Lower>();
  EXPECT_LT((upper * solve_upper(T, B) - B).norm(), kTight);
  EXPECT_LT((lower * solve_lower(T, B) - B).norm(), kTight);
  const CholeskyFactors factors(T.transpose() * T);
  const MatrixXd whitened = factors.solve_lower(T.transpose());
  EXPECT_LT((whitened * whitened.transpose() - MatrixXd::Identity(5, 5)).norm(), 1e-10);
}

}  // namespace
}  // namespace wheelwright::core

// SPDX-License-Identifier: Apache-2.0
#include "identify/moments.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "identify/gram_kernels.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::identify::moments_test {
namespace {

using testing_support::block_of;
using testing_support::Random;

TEST(GramKernels, EveryVariantGivesTheSameDigits) {
  Random random(1);
  const auto variants = gram_kernels::available();
  ASSERT_GE(variants.size(), 1U);
  for (const std::size_t columns : {4U, 8U, 12U, 16U, 20U}) {
    for (const std::size_t rows : {0U, 1U, 7U, 100U}) {
      const core::RowMatrix b = random.matrix(static_cast<Eigen::Index>(rows), static_cast<Eigen::Index>(columns));
      const core::RowMatrix y = random.matrix(static_cast<Eigen::Index>(rows), 1);
      const std::size_t p = columns - 1;
      const gram_kernels::Matrix of_b{b.data(), columns}, of_y{y.data(), 1};
      const auto run = [&](const gram_kernels::GramKernels& kernels, bool upper) {
        std::vector<double> sums((p + 1) * columns, 0.25);
        kernels.products(of_b, p, of_b, columns, of_y, rows, upper, sums.data());
        std::vector<double> kept;
        for (std::size_t j = 0; j <= p; ++j) {
          for (std::size_t l = upper && j < p ? j : 0; l < columns; ++l) {
            kept.push_back(sums[j * columns + l]);
          }
        }
        std::vector<double> gradient(columns, 0.5), squares(gram_kernels::kGroup, 0.0);
        const Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(static_cast<Eigen::Index>(columns), -1.0, 2.0);
        kernels.gradient(of_y, of_b, columns, rows, x.data(), gradient.data(), squares.data());
        kept.insert(kept.end(), gradient.begin(), gradient.end());
        kept.insert(kept.end(), squares.begin(), squares.end());
        return kept;
      };
      for (const bool upper : {false, true}) {
        const auto expected = run(*variants.front(), upper);
        for (const auto* kernels : variants) {
          EXPECT_EQ(run(*kernels, upper), expected) << kernels->name << ", " << columns << " columns";
        }
      }
    }
  }
}

RegressionBlock rows(std::uint64_t seed, Eigen::Index instants, Eigen::Index columns, std::size_t n) {
  Random random(seed);
  const auto count = instants * static_cast<Eigen::Index>(n);
  const Eigen::MatrixXd Y = random.matrix(count, columns);
  return block_of(Y, random.matrix(count, 1), n);
}

void expect_near(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b, double scale) {
  ASSERT_EQ(a.rows(), b.rows());
  EXPECT_LE((a - b).cwiseAbs().maxCoeff(), 1e-14 * scale);
}

TEST(Moments, AreTheSumsTheyAreCalled) {
  for (const Eigen::Index p : {1, 3, 4, 8, 13, 17}) {
    const RegressionBlock r = rows(7, 3000, 2 * p, 2);
    RegressionMoments sums(2, static_cast<std::size_t>(p), true, 64);
    sums.add(r);
    const Eigen::Vector2d weights(0.5, 3.0);
    const Eigen::VectorXd w = Eigen::VectorXd::NullaryExpr(6000, [&](Eigen::Index i) { return weights[i % 2]; });
    const Eigen::MatrixXd Y = w.asDiagonal() * r.Y.leftCols(p), Z = w.asDiagonal() * r.Y.rightCols(p);
    const Eigen::VectorXd y = w.asDiagonal() * r.y;
    const MomentSums total = sums.total(weights);
    const double scale = 6000.0 * 9.0;  // the sum of as many products of at most 9
    expect_near(total.YY, Y.transpose() * Y, scale);
    expect_near(total.Yy, Y.transpose() * y, scale);
    expect_near(total.ZY, Z.transpose() * Y, scale);
    expect_near(total.ZZ, Z.transpose() * Z, scale);
    expect_near(total.Zy, Z.transpose() * y, scale);
    EXPECT_NEAR(total.yy, y.squaredNorm(), 1e-14 * scale);
  }
}

TEST(Moments, OfBlocksAddUpAndCoverTheLogInOrder) {
  const RegressionBlock r = rows(3, 1000, 4, 1);
  RegressionMoments sums(1, 4, false, 16);
  sums.add(r);
  ASSERT_LE(sums.blocks().size(), 32U);
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(1);
  Eigen::MatrixXd together = Eigen::MatrixXd::Zero(4, 4);
  std::size_t instants = 0;
  double before = -1.0;
  for (std::size_t b = 0; b < sums.blocks().size(); ++b) {
    together += sums.block(b, one).YY;
    EXPECT_GT(sums.blocks()[b].first, before);
    EXPECT_GE(sums.blocks()[b].last, sums.blocks()[b].first);
    before = sums.blocks()[b].last;
    instants += sums.blocks()[b].instants;
  }
  EXPECT_EQ(instants, 1000U);
  expect_near(together, sums.total(one).YY, 1000.0);
  EXPECT_EQ(before, r.t.back());
}

TEST(Moments, DoNotDependOnHowTheRowsAreHandedOver) {
  const RegressionBlock r = rows(11, 2500, 10, 2);
  RegressionMoments whole(2, 5, true, 32);
  whole.add(r);
  RegressionMoments pieces(2, 5, true, 32);
  std::size_t first = 0;
  for (std::size_t length = 1; first < 2500; length = length % 97 + 13) {
    const std::size_t count = std::min(length, 2500 - first);
    const auto from = static_cast<Eigen::Index>(2 * first), number = static_cast<Eigen::Index>(2 * count);
    pieces.add(block_of(r.Y.middleRows(from, number), r.y.segment(from, number), 2));
    first += count;
  }
  const Eigen::Vector2d w(1.0, 0.7);
  ASSERT_EQ(pieces.instants(), whole.instants());
  EXPECT_EQ(pieces.total(w).YY, whole.total(w).YY);
  EXPECT_EQ(pieces.total(w).yy, whole.total(w).yy);
  EXPECT_EQ(pieces.total(w).ZY, whole.total(w).ZY);
}

TEST(Moments, RefuseRowsOfAnotherShape) {
  const RegressionBlock r = rows(5, 10, 4, 1);
  RegressionMoments half(1, 4, true), wide(1, 5), two(2, 4);
  EXPECT_THROW(half.add(r), InvalidArgument);
  EXPECT_THROW(wide.add(r), InvalidArgument);
  EXPECT_THROW(two.add(r), InvalidArgument);
}

TEST(EfficientWeights, AreOneOverEachOutputsNoise) {
  Random random(21);
  const Eigen::MatrixXd Y = random.matrix(20000, 2);
  Eigen::VectorXd y = Y * Eigen::Vector2d(2.0, -1.0);
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    y[i] += (i % 2 == 0 ? 0.1 : 4.0) * random.normal();
  }
  core::RegressionTable table(block_of(Y, y, 2));
  const Eigen::VectorXd w = efficient_weights(moments(table));
  // The standard deviation of 10,000 normal values is known to 0.7 %: four times that.
  EXPECT_NEAR(w[0], 10.0, 0.03 * 10.0);
  EXPECT_NEAR(w[1], 0.25, 0.03 * 0.25);
}

}  // namespace
}  // namespace wheelwright::identify::moments_test

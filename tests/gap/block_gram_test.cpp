// SPDX-License-Identifier: Apache-2.0
// Oracle: QR on the rows themselves, block by block.
#include "gap/rows/block_gram.hpp"

#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/QR>

#include "core/error.hpp"

namespace wheelwright::gap::block_gram_test {
namespace {

constexpr double kDuration = 40.0;
constexpr std::size_t kBlocks = 8;
constexpr double kPurge = 0.5;

// Two spaces of different rates; the second one lacks column 1.
std::vector<RowSpace> random_spaces(unsigned seed, std::size_t columns = 5) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> normal;
  std::vector<RowSpace> spaces;
  for (const double step : {0.05, 0.5}) {
    RowSpace space;
    const auto n = static_cast<Eigen::Index>(kDuration / step);
    space.t = Eigen::VectorXd::LinSpaced(n, 0.0, kDuration);
    space.floor = step < 0.1 ? 0.3 : 2.0;
    space.response = Eigen::VectorXd::NullaryExpr(n, [&] { return normal(rng); });
    for (std::size_t c = 0; c < columns; ++c) {
      space.columns.push_back(Eigen::VectorXd::NullaryExpr(n, [&] { return normal(rng); }));
      space.response += 0.7 * (static_cast<double>(c) - 1.5) * space.columns[c];
    }
    spaces.push_back(space);
  }
  spaces[1].columns[1].resize(0);
  return spaces;
}

struct Rows {
  Eigen::MatrixXd X;
  Eigen::VectorXd y;
};

// Whitened rows of those of `spaces` that `take(block, inner)` wants.
template <typename Take>
Rows rows_of(const std::vector<RowSpace>& spaces, const Subset& subset, const Take& take) {
  std::vector<std::vector<double>> lines;
  for (const RowSpace& space : spaces) {
    for (Eigen::Index k = 0; k < space.t.size(); ++k) {
      const double length = kDuration / static_cast<double>(kBlocks);
      const auto block = std::min<std::size_t>(kBlocks - 1, static_cast<std::size_t>(space.t[k] / length));
      const double from = static_cast<double>(block) * length;
      const bool inner =
          (block == 0 || space.t[k] >= from + kPurge) && (block + 1 == kBlocks || space.t[k] < from + length - kPurge);
      if (!take(block, inner)) {
        continue;
      }
      const auto value = [&](std::size_t c) { return space.columns[c].size() > 0 ? space.columns[c][k] : 0.0; };
      std::vector<double> line{space.response[k]};
      for (const std::size_t f : subset.fixed) line[0] -= value(f);
      for (const std::size_t c : subset.columns) line.push_back(value(c));
      for (double& v : line) v /= space.floor;
      lines.push_back(line);
    }
  }
  Rows rows;
  rows.X.resize(static_cast<Eigen::Index>(lines.size()), static_cast<Eigen::Index>(subset.columns.size()));
  rows.y.resize(rows.X.rows());
  for (Eigen::Index i = 0; i < rows.X.rows(); ++i) {
    const auto& line = lines[static_cast<std::size_t>(i)];
    rows.y[i] = line[0];
    for (Eigen::Index j = 0; j < rows.X.cols(); ++j) rows.X(i, j) = line[static_cast<std::size_t>(j) + 1];
  }
  return rows;
}

// The prior as rows of its own.
Eigen::VectorXd solve(Rows rows, const Subset& subset) {
  const Eigen::Index n = rows.X.rows(), k = rows.X.cols();
  if (k == 0) {
    return Eigen::VectorXd(0);
  }
  rows.X.conservativeResize(n + k, k);
  rows.y.conservativeResize(n + k);
  rows.y.tail(k).setZero();
  rows.X.bottomRows(k).setZero();
  for (Eigen::Index j = 0; j < k && !subset.precision.empty(); ++j) {
    rows.X(n + j, j) = std::sqrt(subset.precision[static_cast<std::size_t>(j)]);
  }
  return rows.X.colPivHouseholderQr().solve(rows.y);
}

BlockOptions options(std::size_t threads = 1) { return {.blocks = kBlocks, .purge = kPurge, .threads = threads}; }

TEST(BlockGram, HeldOutErrorIsThatOfQrOnTheRows) {
  const std::vector<RowSpace> spaces = random_spaces(1);
  const BlockGram gram(spaces, options());
  for (const Subset& subset : {Subset{{0, 2, 3}}, Subset{{1}, {0, 4}}, Subset{{4, 1, 0}, {2}, {}, {30.0, 0.0, 5.0}},
                               Subset{{}, {3}}, Subset{}}) {
    double sum = 0.0;
    const Eigen::VectorXd loss = gram.held_out_loss(subset);
    for (std::size_t b = 0; b < kBlocks; ++b) {
      const Rows train = rows_of(spaces, subset, [b](std::size_t block, bool inner) { return inner && block != b; });
      const Rows test = rows_of(spaces, subset, [b](std::size_t block, bool inner) { return inner && block == b; });
      const double expected = (test.y - test.X * solve(train, subset)).squaredNorm();
      EXPECT_NEAR(loss[static_cast<Eigen::Index>(b)], expected, 1e-9 * expected);
      EXPECT_EQ(gram.rows()[static_cast<Eigen::Index>(b)], static_cast<double>(test.y.size()));
      sum += expected;
    }
    EXPECT_NEAR(gram.held_out_error(subset), sum / gram.rows().sum(), 1e-9 * sum / gram.rows().sum());
  }
}

// Wilcoxon's statistic by hand: ranks 1, 2, 3 of −1, 2, 5 have 5 of 6 above zero, mean 3 and variance 3.5.
TEST(SignedRank, IsWilcoxonsAndHasNoUseForZeros) {
  EXPECT_NEAR(signed_rank(Eigen::Vector3d(2.0, -1.0, 5.0)), 2.0 / std::sqrt(3.5), 1e-12);
  Eigen::VectorXd with_zeros = Eigen::VectorXd::Zero(40);
  with_zeros.head(3) << 2.0, -1.0, 5.0;
  EXPECT_EQ(signed_rank(with_zeros), signed_rank(with_zeros.head(3)));
  EXPECT_EQ(signed_rank(Eigen::VectorXd::Zero(4)), 0.0);
}

TEST(HeldOutPieces, AreThoseOfQrOnTheRowsAndAddUpToTheBlocks) {
  const std::vector<RowSpace> spaces = random_spaces(5);
  const BlockGram gram(spaces, options());
  const Subset subset{{0, 1, 2}, {4}, {}, {20.0, 0.0, 0.0}};
  const Eigen::VectorXd blocks = gram.held_out_loss(subset);
  // 5 s less 0.5 s at the ends within: four pieces of a second, or one that is no shorter than a block.
  for (const auto& [length, each] : {std::pair{1.0, 4}, std::pair{7.0, 1}}) {
    const Eigen::VectorXd pieces = held_out_pieces(gram, spaces, subset, length);
    ASSERT_EQ(pieces.size(), static_cast<Eigen::Index>(kBlocks) * each);
    for (std::size_t b = 0; b < kBlocks; ++b) {
      const auto block = static_cast<Eigen::Index>(b);
      EXPECT_NEAR(pieces.segment(each * block, each).sum(), blocks[block], 1e-9 * blocks[block]);
    }
  }
  const Eigen::VectorXd pieces = held_out_pieces(gram, spaces, subset, 1.0);
  const std::size_t b = 3;  // from 15 to 20 s; the second of its pieces from 16.5 to 17.5 s
  const Eigen::VectorXd x =
      solve(rows_of(spaces, subset, [](std::size_t block, bool inner) { return inner && block != b; }), subset);
  double expected = 0.0;
  for (const RowSpace& space : spaces) {
    for (Eigen::Index k = 0; k < space.t.size(); ++k) {
      if (space.t[k] >= 16.5 && space.t[k] < 17.5) {
        double left = space.response[k] - space.columns[4][k];
        for (std::size_t i = 0; i < subset.columns.size(); ++i) {
          const Eigen::VectorXd& column = space.columns[subset.columns[i]];
          left -= column.size() > 0 ? x[static_cast<Eigen::Index>(i)] * column[k] : 0.0;
        }
        expected += std::pow(left / space.floor, 2);
      }
    }
  }
  EXPECT_NEAR(pieces[4 * b + 1], expected, 1e-9 * expected);
  EXPECT_THROW((void)held_out_pieces(gram, spaces, subset, 0.0), InvalidArgument);
}

// A clock that jumps by 1e10 s made pieces of a second out of all of it: 2 GB for 1.7e9 s, not enough memory for 1e10.
TEST(HeldOutPieces, AreNoMoreThanRowsWhereTheClockJumps) {
  const Subset subset{{0, 1, 2}};
  std::vector<RowSpace> spaces = random_spaces(5);
  for (RowSpace& space : spaces) {
    for (Eigen::Index k = space.t.size() / 2; k < space.t.size(); ++k) {
      space.t[k] += 1e10;
    }
  }
  const BlockGram gram(spaces, options());
  Eigen::Index rows = 0;
  for (const RowSpace& space : spaces) {
    rows += space.t.size();
  }
  const Eigen::VectorXd pieces = held_out_pieces(gram, spaces, subset, 1.0);
  EXPECT_LE(pieces.size(), rows);
  EXPECT_NEAR(pieces.sum(), gram.held_out_loss(subset).sum(), 1e-9 * pieces.sum());
}

TEST(BlockGram, FitIsThatOfQrOnAllRowsAndItsCovarianceTheJackknife) {
  const std::vector<RowSpace> spaces = random_spaces(2);
  const BlockGram gram(spaces, options());
  const Subset subset{{0, 1, 4}, {2}};
  const BlockFit fit = gram.fit(subset);
  const Rows all = rows_of(spaces, subset, [](std::size_t, bool) { return true; });
  const Eigen::VectorXd x = solve(all, subset);
  EXPECT_LE((fit.coefficients - x).norm(), 1e-9 * x.norm());
  EXPECT_NEAR(fit.mean_square, (all.y - all.X * x).squaredNorm() / gram.all_rows(), 1e-9 * fit.mean_square);
  Eigen::MatrixXd jackknife = Eigen::MatrixXd::Zero(3, 3);
  for (std::size_t b = 0; b < kBlocks; ++b) {
    const Eigen::VectorXd without =
        solve(rows_of(spaces, subset, [b](std::size_t block, bool) { return block != b; }), subset) - x;
    jackknife += (kBlocks - 1.0) / kBlocks * without * without.transpose();
  }
  EXPECT_LE((fit.covariance - jackknife).norm(), 1e-7 * jackknife.norm());
}

TEST(BlockGram, SignsHoldAndLeaveTheBestOfTheRest) {
  const std::vector<RowSpace> spaces = random_spaces(3);
  const BlockGram gram(spaces, options());
  // The response has −1.05 of column 0 and +1.75 of column 4.
  const BlockFit signed_fit = gram.fit({{0, 4, 2}, {}, {1, 1, 0}});
  const BlockFit without = gram.fit({{4, 2}});
  EXPECT_EQ(signed_fit.coefficients[0], 0.0);
  EXPECT_TRUE(signed_fit.at_bound[0]);
  EXPECT_FALSE(signed_fit.at_bound[1]);
  EXPECT_NEAR(signed_fit.coefficients[1], without.coefficients[0], 1e-9);
  EXPECT_NEAR(signed_fit.held_out_error, without.held_out_error, 1e-9);
  EXPECT_NEAR(gram.held_out_error({{0, 4}, {}, {-1, 1}}), gram.held_out_error({{0, 4}}), 1e-12);
}

TEST(BlockGram, CollinearColumnsCountOnce) {
  std::vector<RowSpace> spaces = random_spaces(4);
  for (RowSpace& space : spaces) {
    space.columns[3] = 2.0 * space.columns[2];
  }
  const BlockGram gram(spaces, options());
  EXPECT_NEAR(gram.held_out_error({{2, 3}}), gram.held_out_error({{2}}), 1e-9);
  EXPECT_TRUE(gram.fit({{2, 3}}).coefficients.allFinite());
}

TEST(BlockGram, ThreadsDoNotChangeABit) {
  const std::vector<RowSpace> spaces = random_spaces(5);
  const BlockGram one(spaces, options(1)), three(spaces, options(3));
  for (std::size_t i = 0; i <= one.columns(); ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      EXPECT_EQ(one.product(i, j), three.product(i, j));
    }
  }
  EXPECT_EQ(one.held_out_error({{0, 3}}), three.held_out_error({{0, 3}}));
}

// Measured efforts are u + ε. A column of u + ε beside a response that is ε takes all of it, and has explained nothing:
// another draw of ε says by how much. Oracle: the losses of the same coefficients without noise in the column.
TEST(BlockGram, WhatAColumnTakesOfTheNoiseIsNoGain) {
  std::mt19937_64 rng(11);
  std::normal_distribution<double> normal;
  constexpr Eigen::Index rows = 4000;
  const auto draw = [&](double deviation) {
    return Eigen::VectorXd(Eigen::VectorXd::NullaryExpr(rows, [&] { return deviation * normal(rng); }));
  };
  for (const double signal : {0.0, 0.5, 2.0}) {  // deviation of u; ε has 1
    RowSpace space;
    space.t = Eigen::VectorXd::LinSpaced(rows, 0.0, kDuration);
    const Eigen::VectorXd u = draw(signal), noise = draw(1.0);
    space.response = noise;
    space.columns = {u + noise, u};
    space.noise = draw(1.0);
    space.noise_columns = {space.noise};
    const BlockGram gram({space}, options());
    const double coefficient = 1.0 / (1.0 + signal * signal);  // that least squares give the first column
    EXPECT_NEAR(gram.fit({{0}}).mean_square, 1.0 - coefficient, 0.06) << signal;
    EXPECT_NEAR(gram.held_out_error({{0}}), 1.0 + std::pow(coefficient * signal, 2), 0.08) << signal;
    EXPECT_NEAR(gram.held_out_error({{}, {0}}), 1.0 + signal * signal, 0.08 * (1.0 + signal * signal)) << signal;
    EXPECT_NEAR(gram.held_out_loss({{0}}).sum(), held_out_pieces(gram, {space}, {{0}}, 0.7).sum(),
                1e-9 * static_cast<double>(rows));
    // What has no noise of its own is what it was.
    RowSpace bare = space;
    bare.noise.resize(0);
    bare.noise_columns.clear();
    const BlockGram plain({bare}, options());
    EXPECT_EQ(gram.held_out_error({{1}}), plain.held_out_error({{1}}));
    EXPECT_EQ(gram.fit({{0}}).coefficients, plain.fit({{0}}).coefficients);
    EXPECT_LT(plain.held_out_error({{0}}), 1.0 - 0.8 * coefficient);
    // A column that only adds noise gains nothing by it.
    space.noise_columns = {-3.0 * space.noise};
    EXPECT_EQ(BlockGram({space}, options()).held_out_error({{0}}), plain.held_out_error({{0}}));
  }
}

TEST(BlockGram, ShortLogsHaveFewerBlocks) {
  const std::vector<RowSpace> spaces = random_spaces(7);  // of 40 s
  EXPECT_EQ(BlockGram(spaces, {.blocks = 16}).blocks(), 16U);
  EXPECT_EQ(BlockGram(spaces, {.blocks = 24}).blocks(), 20U);
  EXPECT_EQ(BlockGram(spaces, {.blocks = 24, .shortest = 10.0}).blocks(), 12U);
  EXPECT_EQ(BlockGram(spaces, {.blocks = 24, .shortest = 10.0, .fewest = 2}).blocks(), 4U);
  EXPECT_EQ(BlockGram(spaces, {.blocks = 6, .shortest = 10.0}).blocks(), 6U);
}

TEST(BlockGram, MisuseIsRefused) {
  std::vector<RowSpace> spaces = random_spaces(6);
  const BlockGram gram(spaces, options());
  EXPECT_THROW((void)gram.held_out_error({{5}}), InvalidArgument);
  EXPECT_THROW((void)gram.held_out_error({{0}, {}, {1, 1}}), InvalidArgument);
  EXPECT_THROW(BlockGram(spaces, {.blocks = 40, .purge = 2.5}), InvalidArgument);
  spaces[0].columns[2][3] = std::nan("");
  EXPECT_THROW(BlockGram(spaces, options()), InvalidArgument);
}

// Oracle: all 2^k choices of unknowns held at zero.
TEST(SignedLeastSquares, IsTheBestOfAllActiveSets) {
  std::mt19937_64 rng(7);
  std::normal_distribution<double> normal;
  for (int run = 0; run < 200; ++run) {
    const Eigen::MatrixXd X = Eigen::MatrixXd::NullaryExpr(12, 5, [&] { return normal(rng); });
    const Eigen::VectorXd y = Eigen::VectorXd::NullaryExpr(12, [&] { return normal(rng); });
    const std::vector<int> sign{1, -1, 0, 1, 1};
    const SignedSolution solution = signed_least_squares(X.transpose() * X, X.transpose() * y, sign);
    double best = y.squaredNorm();
    for (unsigned set = 1; set < 32; ++set) {
      std::vector<Eigen::Index> in;
      for (Eigen::Index j = 0; j < 5; ++j) {
        if ((set >> j) & 1U) in.push_back(j);
      }
      Eigen::MatrixXd part(12, static_cast<Eigen::Index>(in.size()));
      for (std::size_t j = 0; j < in.size(); ++j) part.col(static_cast<Eigen::Index>(j)) = X.col(in[j]);
      const Eigen::VectorXd x = part.colPivHouseholderQr().solve(y);
      bool allowed = true;
      for (std::size_t j = 0; j < in.size(); ++j) {
        allowed = allowed && sign[static_cast<std::size_t>(in[j])] * x[static_cast<Eigen::Index>(j)] >= 0.0;
      }
      best = allowed ? std::min(best, (y - part * x).squaredNorm()) : best;
    }
    EXPECT_NEAR((y - X * solution.x).squaredNorm(), best, 1e-10 * best);
    for (std::size_t j = 0; j < 5; ++j) {
      EXPECT_GE(sign[j] * solution.x[static_cast<Eigen::Index>(j)], 0.0);
    }
  }
}

}  // namespace
}  // namespace wheelwright::gap::block_gram_test

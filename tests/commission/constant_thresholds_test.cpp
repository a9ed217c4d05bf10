// SPDX-License-Identifier: Apache-2.0
// Constant thresholds by experiment, on rows that no model made: what they promise, and what tests the promise.
#include "commission/constant_thresholds.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "core/error.hpp"

namespace wheelwright::commission {
namespace {

constexpr double kStep = 0.01;                    // s
constexpr std::size_t kBlock = 50, kOutputs = 2;  // instants, of which a block holds kBlock
constexpr Eigen::Index kParameters = 3;

using Law = std::function<double(std::mt19937_64&)>;

// Rows y = Yθ + e of kOutputs outputs: smooth regressors, errors of a moving mean of independent ones, `spread` times
// as large in output 1 as in output 0. `loud` multiplies the errors of an instant.
struct Drive {
  core::RowMatrix Y;
  Eigen::VectorXd y;

  Drive(
      std::size_t instants, const Eigen::VectorXd& theta, const Law& law, std::mt19937_64& random,
      const std::function<double(std::size_t)>& loud = [](std::size_t) { return 1.0; }) {
    const auto rows = static_cast<Eigen::Index>(instants * kOutputs);
    Y.resize(rows, kParameters);
    y.resize(rows);
    std::uniform_real_distribution<double> phase(0.0, 6.283);
    const double a = phase(random), b = phase(random), c = phase(random);
    double state[kOutputs] = {};
    for (std::size_t k = 0; k < instants; ++k) {
      const double t = kStep * static_cast<double>(k);
      for (std::size_t i = 0; i < kOutputs; ++i) {
        const auto row = static_cast<Eigen::Index>(k * kOutputs + i);
        const double w = i == 0 ? 1.0 : 1.7;
        Y.row(row) << std::sin(2.1 * w * t + a), std::cos(3.3 * w * t + b), 0.5 + std::sin(5.9 * w * t + c);
        state[i] = 0.9 * state[i] + law(random);
        y[row] = Y.row(row).dot(theta) + (i == 0 ? 1.0 : 4.0) * loud(k) * state[i];
      }
    }
  }

  [[nodiscard]] core::RegressionTable table() const {
    core::RegressionBlock block;
    const auto instants = static_cast<std::size_t>(y.size()) / kOutputs;
    block.resize(instants, kOutputs, kParameters);
    for (std::size_t k = 0; k < instants; ++k) {
      block.sample[k] = k;
      block.t[k] = kStep * static_cast<double>(k);
    }
    block.Y = Y;
    block.dY.setZero();
    block.y = y;
    block.dy.setZero();
    return core::RegressionTable(std::move(block));
  }

  // Least squares of the rows for which `use(instant)`, each output weighted by `weight`.
  [[nodiscard]] Eigen::VectorXd fit(const Eigen::Vector2d& weight, const std::function<bool(std::size_t)>& use) const {
    Eigen::MatrixXd A = Y;
    Eigen::VectorXd b = y;
    for (Eigen::Index row = 0; row < A.rows(); ++row) {
      const double w = use(static_cast<std::size_t>(row) / kOutputs) ? weight[row % 2] : 0.0;
      A.row(row) *= w;
      b[row] *= w;
    }
    return Eigen::MatrixXd(A.transpose() * A).fullPivLu().solve(A.transpose() * b);
  }

  // Least squares of all rows, weighted as they turn out in `rounds`.
  [[nodiscard]] Eigen::VectorXd fit(int rounds = 3) const {
    Eigen::Vector2d weight(1.0, 1.0);
    Eigen::VectorXd theta;
    for (int k = 0; k < rounds; ++k) {
      theta = fit(weight, [](std::size_t) { return true; });
      weight = weights(theta);
    }
    return theta;
  }

  [[nodiscard]] Eigen::Vector2d weights(const Eigen::VectorXd& theta) const {
    Eigen::Vector2d square(0.0, 0.0);
    for (Eigen::Index row = 0; row < y.size(); ++row) {
      square[row % 2] += std::pow(y[row] - Y.row(row).dot(theta), 2);
    }
    return square.cwiseSqrt().cwiseInverse();
  }

  [[nodiscard]] double largest(std::size_t output, std::size_t from, std::size_t to,
                               const Eigen::VectorXd& theta) const {
    double most = 0.0;
    for (std::size_t k = from; k < to; ++k) {
      const auto row = static_cast<Eigen::Index>(k * kOutputs + output);
      most = std::max(most, std::abs(y[row] - Y.row(row).dot(theta)));
    }
    return most;
  }
};

const ConstantThresholdOptions kOptions{.step = kStep, .memory = kStep * kBlock};

const Law kGaussian = [](std::mt19937_64& g) { return std::normal_distribution<double>()(g); };
const Law kHeavy = [](std::mt19937_64& g) { return std::student_t_distribution<double>(3.0)(g); };
const Law kBounded = [](std::mt19937_64& g) { return std::uniform_real_distribution<double>(-1.0, 1.0)(g); };

std::optional<detector::ConstantThresholds> thresholds_of(const Drive& drive,
                                                          const ConstantThresholdOptions& options = kOptions,
                                                          int rounds = 3) {
  core::RegressionTable rows = drive.table();
  return constant_thresholds(rows, drive.fit(rounds), options);
}

TEST(ConstantThresholds, AreTheLargestResidualsOfFitsThatLackTheBlock) {
  std::mt19937_64 random(1);
  const Drive drive(12 * kBlock, Eigen::Vector3d(1.0, -2.0, 0.5), kGaussian, random);
  const auto found = thresholds_of(drive, kOptions, 40);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->blocks, 12U);
  EXPECT_NEAR(found->block, kStep * kBlock, 0.01 * kStep * kBlock);
  const Eigen::VectorXd theta = drive.fit(40);
  const Eigen::Vector2d weight = drive.weights(theta);
  for (std::size_t i = 0; i < kOutputs; ++i) {
    double largest = 0.0;
    for (std::size_t block = 0; block < 12; ++block) {
      const Eigen::VectorXd without = drive.fit(weight, [&](std::size_t instant) {
        const std::size_t at = instant / kBlock;
        return at + 1 < block || at > block + 1;
      });
      largest = std::max(largest, drive.largest(i, block * kBlock, (block + 1) * kBlock, without));
    }
    EXPECT_NEAR(found->outputs[i].value, largest, 1e-9 * largest);
    EXPECT_FALSE(found->outputs[i].stated);
  }
}

// A log promises at most 1/(n + 1) for each output, whatever the law of its errors; so over many logs, each with one
// further block, no more exceed than a binomial law of that probability lets expect. A threshold that promised half as
// much would be caught.
TEST(ConstantThresholds, RaiseNoMoreFalseAlarmsThanTheyPromise) {
  for (const auto& [law, seed] : {std::pair{kGaussian, 11U}, std::pair{kHeavy, 12U}, std::pair{kBounded, 13U}}) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> size(-3.0, 3.0);
    constexpr std::size_t logs = 1200, blocks = 20;
    std::size_t exceeded = 0;
    double promised = 0.0;
    for (std::size_t log = 0; log < logs; ++log) {
      const Eigen::Vector3d theta(size(random), size(random), size(random));
      // The block to come follows the log after a pause.
      const Drive drive((blocks + 3) * kBlock, theta, law, random);
      Drive learnt = drive;
      learnt.Y.conservativeResize(blocks * kBlock * kOutputs, Eigen::NoChange);
      learnt.y.conservativeResize(blocks * kBlock * kOutputs);
      const auto found = thresholds_of(learnt);
      ASSERT_TRUE(found);
      ASSERT_EQ(found->blocks, blocks);
      ASSERT_TRUE(found->false_alarms());
      EXPECT_DOUBLE_EQ(*found->false_alarms(), 2.0 / 21.0);
      promised += *found->false_alarms() / 2.0;
      exceeded +=
          drive.largest(0, (blocks + 2) * kBlock, (blocks + 3) * kBlock, learnt.fit()) > found->outputs[0].value;
    }
    const double spread = std::sqrt(promised * (1.0 - 1.0 / 21.0));
    EXPECT_LE(static_cast<double>(exceeded), promised + 3.1 * spread) << "seed " << seed;  // 1 in 1000
    EXPECT_GE(static_cast<double>(exceeded), 0.5 * promised) << "seed " << seed;  // they are no larger than need be
  }
}

// P(k or more of m exceed the largest of n), by dealing ranks.
TEST(ConstantThresholds, ChanceIsThatOfRanks) {
  std::mt19937_64 random(5);
  std::vector<int> seen(4, 0);
  double told[4] = {1.0, 0.0, 0.0, 0.0};
  for (int deal = 0; deal < 300; ++deal) {
    const Drive drive(20 * kBlock, Eigen::Vector3d(1.0, 1.0, 1.0), kHeavy, random);
    const auto found = thresholds_of(drive);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->learning, 14U);
    const detector::ConstantThreshold& output = found->outputs[0];
    EXPECT_EQ(output.held_out, 6U);
    for (std::size_t k = 0; k < 4 && k <= output.exceeded; ++k) {
      ++seen[k];
    }
    if (output.exceeded < 4) {
      told[output.exceeded] = output.chance;
    }
  }
  constexpr int deals = 200000;
  std::vector<int> dealt(4, 0), ranks(20);
  std::iota(ranks.begin(), ranks.end(), 0);
  for (int deal = 0; deal < deals; ++deal) {
    std::shuffle(ranks.begin(), ranks.end(), random);
    const int learnt = *std::max_element(ranks.begin() + 6, ranks.end());
    const auto above = std::count_if(ranks.begin(), ranks.begin() + 6, [&](int rank) { return rank > learnt; });
    for (std::ptrdiff_t k = 0; k < 4 && k <= above; ++k) {
      ++dealt[static_cast<std::size_t>(k)];
    }
  }
  for (std::size_t k = 1; k < 4; ++k) {
    const double expected = static_cast<double>(dealt[k]) / deals;
    ASSERT_GT(told[k], 0.0) << k;
    EXPECT_NEAR(told[k], expected, 4.0 * std::sqrt(expected / deals)) << k;
    // Held-out blocks of drives that are alike exceed as often as that.
    EXPECT_LE(seen[k], 300 * expected + 3.5 * std::sqrt(300 * expected)) << k;
  }
}

TEST(ConstantThresholds, ATestRefutesThePromiseOfDrivesWhoseBlocksAreNotAlike) {
  std::mt19937_64 random(7);
  const auto louder = [](std::size_t instant) {
    const std::size_t tenth = instant * 10 / (40 * kBlock);
    return tenth % 3 == 2 ? 4.0 : 1.0;
  };
  const Drive odd(40 * kBlock, Eigen::Vector3d(1.0, 1.0, 1.0), kGaussian, random, louder);
  const auto refuted = thresholds_of(odd);
  ASSERT_TRUE(refuted);
  EXPECT_TRUE(refuted->refuted());
  EXPECT_GE(refuted->outputs[0].exceeded, 6U);
  EXPECT_NE(sentence(*refuted).find("nothing is promised"), std::string::npos);
  int falsely = 0;
  for (int k = 0; k < 200; ++k) {
    const Drive drive(20 * kBlock, Eigen::Vector3d(1.0, 1.0, 1.0), kGaussian, random);
    falsely += thresholds_of(drive)->refuted() ? 1 : 0;
  }
  EXPECT_LE(falsely, 7);  // at 1 %: 8 and more are one in a thousand
}

TEST(ConstantThresholds, StatedOnesStayAndAreCountedOnTheLog) {
  std::mt19937_64 random(3);
  const Drive drive(20 * kBlock, Eigen::Vector3d(1.0, -1.0, 2.0), kGaussian, random);
  const auto found = thresholds_of(drive);
  ASSERT_TRUE(found);
  ConstantThresholdOptions options = kOptions;
  options.stated = {0.999 * found->outputs[0].value, std::nullopt};
  const auto stated = thresholds_of(drive, options);
  ASSERT_TRUE(stated);
  EXPECT_EQ(stated->outputs[0].value, *options.stated[0]);
  EXPECT_TRUE(stated->outputs[0].stated);
  EXPECT_EQ(stated->outputs[0].held_out, 20U);
  EXPECT_EQ(stated->outputs[0].exceeded, 1U);
  EXPECT_EQ(stated->outputs[1].value, found->outputs[1].value);
  EXPECT_FALSE(stated->false_alarms());
  EXPECT_NE(sentence(*stated).find("robot file"), std::string::npos);
}

TEST(ConstantThresholds, TooShortALogHasThoseThatAreStated) {
  std::mt19937_64 random(4);
  const Drive drive(10 * kBlock - 1, Eigen::Vector3d(1.0, 1.0, 1.0), kGaussian, random);
  EXPECT_FALSE(thresholds_of(drive));
  ConstantThresholdOptions options = kOptions;
  options.stated = {1.5, std::nullopt};
  EXPECT_FALSE(thresholds_of(drive, options));
  options.stated = {1.5, 2.5};
  const auto stated = thresholds_of(drive, options);
  ASSERT_TRUE(stated);
  EXPECT_EQ(stated->blocks, 0U);
  EXPECT_EQ(stated->mu(), Eigen::VectorXd(Eigen::Vector2d(1.5, 2.5)));
}

TEST(ConstantThresholds, OfLongLogsHaveLongerBlocksNotMore) {
  std::mt19937_64 random(6);
  const Drive drive(95 * kBlock, Eigen::Vector3d(1.0, 1.0, 1.0), kGaussian, random);
  ConstantThresholdOptions options = kOptions;
  options.most_blocks = 20;
  const auto few = thresholds_of(drive, options);
  ASSERT_TRUE(few);
  EXPECT_EQ(few->blocks, 11U);  // of eight
  EXPECT_NEAR(few->block, 8 * kStep * kBlock, 0.1);
}

TEST(ConstantThresholds, RefuseOptionsThatMakeNoSense) {
  std::mt19937_64 random(8);
  const Drive drive(12 * kBlock, Eigen::Vector3d(1.0, 1.0, 1.0), kGaussian, random);
  for (const ConstantThresholdOptions& options :
       {ConstantThresholdOptions{.step = 0.0}, ConstantThresholdOptions{.step = kStep, .memory = -1.0},
        ConstantThresholdOptions{.step = kStep, .stated = {1.0}},
        ConstantThresholdOptions{.step = kStep, .most_blocks = 18},
        ConstantThresholdOptions{.step = kStep, .most_blocks = 21}}) {
    EXPECT_THROW(static_cast<void>(thresholds_of(drive, options)), InvalidArgument);
  }
}

}  // namespace
}  // namespace wheelwright::commission

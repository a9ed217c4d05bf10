// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/identifiability.hpp"

#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "core/error.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::inference::information_over_time_test {
namespace {

using testing_support::block_of;
using testing_support::Random;

identify::RegressionMoments moments_of(const Eigen::MatrixXd& Y) {
  identify::RegressionMoments moments(1, static_cast<std::size_t>(Y.cols()));
  moments.add(block_of(Y, Eigen::VectorXd::Zero(Y.rows()), 1));
  return moments;
}

// 20 s at 100 Hz, the second half at a standstill.
TEST(InformationOverTime, StopsWhereTheRobotStops) {
  Random random(1);
  Eigen::MatrixXd Y = random.matrix(2000, 3);
  Y.bottomRows(1000).setZero();
  InformationOptions options;
  options.seconds = 1.0;
  const InformationOverTime info = information_over_time(moments_of(Y), options);
  ASSERT_GE(info.windows.size(), 19U);
  ASSERT_LE(info.windows.size(), 20U);
  const Eigen::MatrixXd inverse = (Y.transpose() * Y).inverse();
  for (std::size_t j = 0; j < 3; ++j) {
    const ParameterInformation& p = info.parameters[j];
    const auto at = static_cast<Eigen::Index>(j);
    EXPECT_NEAR(p.information, 1.0 / inverse(at, at), 1e-11 * p.information);
    EXPECT_NEAR(p.share.sum(), 1.0, 1e-12);
    EXPECT_NEAR(p.cumulative[p.cumulative.size() - 1], 1.0, 1e-12);
    double carried = 0.0;
    for (const std::size_t k : p.shortest) {
      EXPECT_LE(info.windows[k].first, 10.0);
      carried += p.share[static_cast<Eigen::Index>(k)];
    }
    EXPECT_GE(carried, 0.8);
    EXPECT_LE(p.seconds, 9.5);  // about eight of the ten moving seconds
    EXPECT_GE(p.seconds, 6.0);
    for (Eigen::Index k = 0; k < p.share.size(); ++k) {
      if (info.windows[static_cast<std::size_t>(k)].first > 10.05) {
        EXPECT_EQ(p.share[k], 0.0);
      }
    }
  }
}

// The second column moves with the first but for two seconds, in which alone the second can be told from it.
TEST(InformationOverTime, FindsTheSecondsThatTellColumnsApart) {
  Random random(2);
  Eigen::MatrixXd Y = random.matrix(2000, 2);
  for (Eigen::Index k = 0; k < 2000; ++k) {
    if (k < 600 || k >= 800) {
      Y(k, 1) = 0.0;
    }
  }
  const identify::RegressionMoments moments = moments_of(Y);
  InformationOptions options;
  options.seconds = 1.0;
  const InformationOverTime info = information_over_time(moments, options);
  const ParameterInformation& second = info.parameters[1];
  ASSERT_FALSE(second.spans.empty());
  EXPECT_GE(second.spans.front().first, 5.0);
  EXPECT_LE(second.spans.back().second, 9.1);
  EXPECT_LE(second.seconds, 4.0);
  EXPECT_GE(info.parameters[0].seconds, 10.0);
}

// Of 1, 2, 3, 4 parts of the information in four windows, 70 % are in the last two, 90 % in the last three.
TEST(InformationOverTime, TakesTheFewestWindows) {
  Eigen::MatrixXd Y(400, 1);
  for (Eigen::Index k = 0; k < 400; ++k) {
    Y(k, 0) = std::sqrt(static_cast<double>(k / 100 + 1));
  }
  InformationOptions options;
  options.seconds = 1.0;
  options.coverage = 0.65;
  const InformationOverTime info = information_over_time(moments_of(Y), options);
  ASSERT_EQ(info.windows.size(), 4U);
  const ParameterInformation& p = info.parameters[0];
  EXPECT_LE((p.share - Eigen::Vector4d(0.1, 0.2, 0.3, 0.4)).norm(), 1e-12);
  EXPECT_EQ(p.shortest, (std::vector<std::size_t>{2, 3}));
  ASSERT_EQ(p.spans.size(), 1U);
  EXPECT_NEAR(p.spans[0].first, 2.0, 1e-9);
}

// Four drives whose clocks all begin at 0: lengths are those of the drives, and no stretch runs backwards.
TEST(InformationOverTime, LengthsAreThoseOfDrivesThatBeginAnew) {
  Random random(4);
  identify::RegressionMoments moments(1, 2);
  double seconds = 0.0;
  for (const Eigen::Index rows : {300, 250, 100, 100}) {
    const Eigen::MatrixXd Y = random.matrix(rows, 2);
    moments.add(block_of(Y, Eigen::VectorXd::Zero(rows), 1));
    seconds += 0.01 * static_cast<double>(rows);
  }
  const InformationOverTime info = information_over_time(moments);
  EXPECT_NEAR(info.seconds, seconds, 0.1);
  for (const ParameterInformation& p : info.parameters) {
    EXPECT_GT(p.seconds, 0.5 * seconds);
    EXPECT_LE(p.seconds, info.seconds + 1e-9);
    for (const auto& [from, to] : p.spans) {
      EXPECT_LE(from, to);
    }
  }
}

TEST(InformationOverTime, IsNoneWhereParametersAreConfounded) {
  Random random(3);
  Eigen::MatrixXd Y = random.matrix(500, 3);
  Y.col(1) = -2.0 * Y.col(0);
  const InformationOverTime info = information_over_time(moments_of(Y));
  EXPECT_EQ(info.parameters[0].information, 0.0);
  EXPECT_EQ(info.parameters[1].information, 0.0);
  EXPECT_TRUE(info.parameters[0].shortest.empty());
  EXPECT_NEAR(info.parameters[2].share.sum(), 1.0, 1e-12);
  InformationOptions bad;
  bad.coverage = 0.0;
  EXPECT_THROW((void)information_over_time(moments_of(Y), bad), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::inference::information_over_time_test

// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "identify/least_squares.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::identify::excitation_test {
namespace {

using ::testing::HasSubstr;
using testing_support::block_of;
using testing_support::Random;

LeastSquaresFit fit_of(const Eigen::MatrixXd& Y, const Eigen::VectorXd& theta) {
  core::RegressionTable table(block_of(Y, Y * theta, 1));
  return least_squares(table);
}

TEST(Excitation, WithoutMotionNothingIsSaid) {
  Eigen::MatrixXd Y = Random(1).matrix(300, 3);
  Y.col(1).setZero();
  const auto findings = judge_excitation(fit_of(Y, Eigen::Vector3d(1, 2, 3)), Eigen::Vector3d::Constant(1e-3), 2.0);
  EXPECT_EQ(findings[0].state, Excitation::identified);
  EXPECT_TRUE(findings[0].reason.empty());
  EXPECT_EQ(findings[1].state, Excitation::not_excited);
  EXPECT_THAT(findings[1].reason, HasSubstr("never occurs"));
  EXPECT_EQ(findings[2].state, Excitation::identified);
}

TEST(Excitation, CopiesOfEachOtherAreNotTold) {
  Eigen::MatrixXd Y = Random(2).matrix(300, 3);
  Y.col(2) = 5.0 * Y.col(0);
  const auto findings = judge_excitation(fit_of(Y, Eigen::Vector3d(1, 2, 3)), Eigen::Vector3d::Constant(1e-3), 2.0);
  EXPECT_EQ(findings[0].state, Excitation::not_excited);
  EXPECT_EQ(findings[1].state, Excitation::identified);
  EXPECT_EQ(findings[2].state, Excitation::not_excited);
  EXPECT_THAT(findings[2].reason, HasSubstr("another parameter"));
}

TEST(Excitation, AColumnOfNoiseIsNoExcitation) {
  const LeastSquaresFit fit = fit_of(Random(3).matrix(300, 2), Eigen::Vector2d(1, 2));
  const Eigen::Vector2d error(1e-3, 1e-3);
  const auto judged = [&](double noise) {
    return judge_excitation(fit, error, 2.0, Eigen::Vector2d(0.0, noise))[1].state;
  };
  EXPECT_EQ(judged(fit.partial_rms[1] / 3.1), Excitation::identified);
  EXPECT_EQ(judged(fit.partial_rms[1] / 2.9), Excitation::not_excited);
}

TEST(Excitation, AnIntervalThatHoldsZeroIsIndistinct) {
  const LeastSquaresFit fit = fit_of(Random(4).matrix(300, 2), Eigen::Vector2d(1.0, 0.1));
  const auto findings = judge_excitation(fit, Eigen::Vector2d(0.06, 0.06), 2.0);
  EXPECT_EQ(findings[0].state, Excitation::identified);
  EXPECT_EQ(findings[1].state, Excitation::indistinct);
}

}  // namespace
}  // namespace wheelwright::identify::excitation_test

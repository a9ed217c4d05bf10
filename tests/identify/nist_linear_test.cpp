// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>

#include "identify/least_squares.hpp"
#include "tests/identify/nist.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::identify::nist_linear_test {
namespace {

using testing_support::block_of;
using testing_support::digits;
using testing_support::nist_limits;
using testing_support::NistLimits;
using testing_support::NistProblem;
using testing_support::read_nist;

// Columns 1, x, x², … or 1 and all predictors.
Eigen::MatrixXd columns_of(const NistProblem& problem) {
  const Eigen::Index p = problem.certified.size();
  Eigen::MatrixXd Y(problem.y.size(), p);
  Y.col(0).setOnes();
  for (Eigen::Index j = 1; j < p; ++j) {
    Y.col(j) = problem.x.cols() > 1 ? Eigen::VectorXd(problem.x.col(j - 1))
                                    : Eigen::VectorXd(Y.col(j - 1).cwiseProduct(problem.x.col(0)));
  }
  return Y;
}

struct Solved {
  LeastSquaresFit fit;
  Eigen::VectorXd sd;
  double residual_sd;
};

Solved solve(const NistProblem& problem) {
  core::RegressionTable rows(block_of(columns_of(problem), problem.y, 1));
  const LeastSquaresFit fit = least_squares(rows);
  const auto freedom = static_cast<double>(problem.y.size() - problem.certified.size());
  const double sd = std::sqrt(fit.weighted_rss / freedom);
  return {fit, sd * fit.inverse_gram.diagonal().cwiseSqrt(), sd};
}

class NistLinear : public ::testing::TestWithParam<const char*> {};

TEST_P(NistLinear, IsAsNearToTheCertifiedValuesAsTheirConditionAllows) {
  const NistProblem problem = read_nist(GetParam());
  const Solved solved = solve(problem);
  const NistLimits limits = nist_limits(columns_of(problem), problem, problem.y.norm(), 0.5e-14);
  EXPECT_EQ(solved.fit.rank, problem.certified.size());
  for (Eigen::Index j = 0; j < problem.certified.size(); ++j) {
    EXPECT_LE(std::abs(solved.fit.estimate[j] - problem.certified[j]), limits.estimate[j]) << j;
    EXPECT_LE(std::abs(solved.sd[j] - problem.certified_sd[j]), limits.sd[j]) << j;
    // The limits say something, of the worst of these problems (Wampler5, Filip), too.
    EXPECT_LE(limits.estimate[j], 2e-3 * std::max(1.0, std::abs(problem.certified[j]))) << j;
  }
  EXPECT_LE(std::abs(solved.residual_sd - problem.residual_sd), limits.residual_sd);
  RecordProperty("digits", std::to_string(digits(solved.fit.estimate, problem.certified)));
}

INSTANTIATE_TEST_SUITE_P(StRD, NistLinear,
                         ::testing::Values("Norris", "Pontius", "Longley", "Wampler1", "Wampler2", "Wampler3",
                                           "Wampler4", "Wampler5", "Filip"),
                         [](const auto& problem) { return std::string(problem.param); });

}  // namespace
}  // namespace wheelwright::identify::nist_linear_test

// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>

#include <wheelwright/identify/least_squares.hpp>

#include "identify/nist.hpp"
#include "support/rows.hpp"

namespace wheelwright::nist_linear_test {
namespace {

using testing_support::block_of;
using testing_support::digits;
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
  RegressionTable rows(block_of(columns_of(problem), problem.y, 1));
  const LeastSquaresFit fit = least_squares(rows);
  const auto freedom = static_cast<double>(problem.y.size() - problem.certified.size());
  const double sd = std::sqrt(fit.weighted_rss / freedom);
  return {fit, sd * fit.inverse_gram.diagonal().cwiseSqrt(), sd};
}

struct Case {
  const char* name;
  // Digits. 16 less those of the condition of the columns as they are, and for Wampler3 to 5 less those by which the
  // residuals outweigh the model (1e2, 1e4 and 1e6 times), of which Wampler1's data are free; where the certified value is
  // 0 (Wampler1 and 2) digits after the point.
  double estimate, sd;
  friend void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }
};

class NistLinear : public ::testing::TestWithParam<Case> {};

TEST_P(NistLinear, ReachesTheCertifiedDigits) {
  const NistProblem problem = read_nist(GetParam().name);
  const Solved solved = solve(problem);
  EXPECT_EQ(solved.fit.rank, problem.certified.size());
  EXPECT_GE(digits(solved.fit.estimate, problem.certified), GetParam().estimate);
  EXPECT_GE(digits(solved.sd, problem.certified_sd), GetParam().sd);
  EXPECT_GE(digits(solved.residual_sd, problem.residual_sd), GetParam().sd);
}

INSTANTIATE_TEST_SUITE_P(StRD, NistLinear,
                         ::testing::Values(Case{"Norris", 12.0, 12.0}, Case{"Pontius", 11.0, 11.0},
                                           Case{"Longley", 10.0, 10.0}, Case{"Wampler1", 9.0, 9.0},
                                           Case{"Wampler2", 11.0, 11.0}, Case{"Wampler3", 9.0, 11.0},
                                           Case{"Wampler4", 8.0, 11.0}, Case{"Wampler5", 6.0, 11.0},
                                           Case{"Filip", 6.0, 6.0}),
                         [](const auto& problem) { return std::string(problem.param.name); });

}  // namespace
}  // namespace wheelwright::nist_linear_test

// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>

#include <wheelwright/identify/variable_projection.hpp>

#include "identify/nist_models.hpp"

namespace wheelwright::nist_nonlinear_test {
namespace {

using testing_support::digits;
using testing_support::nist_models;
using testing_support::NistModel;
using testing_support::NistProblem;
using testing_support::NistRegression;
using testing_support::read_nist;

class Nist : public ::testing::TestWithParam<NistModel> {};

std::string name_of(const ::testing::TestParamInfo<NistModel>& info) { return info.param.name; }

struct Found {
  SeparableFit fit;
  Eigen::VectorXd b, sd;
};

Found solve(const NistProblem& problem, bool split, bool full, const Eigen::VectorXd& start, const NistModel& model) {
  const NistRegression regression(problem, model, split);
  VariableProjectionOptions options;
  options.start = regression.shape_of(start);
  options.full_jacobian = full;
  options.most_iterations = 2000;
  Found found{variable_projection(regression, options), Eigen::VectorXd(problem.certified.size()),
              Eigen::VectorXd(problem.certified.size())};
  const Eigen::Index q = regression.shapes();
  for (Eigen::Index j = 0; j < problem.certified.size(); ++j) {
    const int at = regression.parameter(j);
    found.b[at] = j < q ? found.fit.shape[j] : found.fit.linear[j - q];
    found.sd[at] = std::sqrt(found.fit.covariance_if_independent(j, j));
  }
  return found;
}

// Certified values have 11 digits. Lanczos1 has exact data: its residuals are rounding (certified rss 1.4e-25), so that
// its standard deviations are too.
void expect_certified(const NistProblem& problem, const Found& found, double wanted) {
  EXPECT_EQ(found.fit.end, SearchEnd::converged);
  EXPECT_GE(digits(found.b, problem.certified), wanted);
  if (problem.name != "Lanczos1") {
    EXPECT_GE(digits(found.sd, problem.certified_sd), wanted);
    EXPECT_GE(digits(found.fit.weighted_rss, problem.rss), wanted);
  }
  for (const ShapeState state : found.fit.state) {
    EXPECT_EQ(state, ShapeState::identified);
  }
}

TEST_P(Nist, IsSolvedByVariableProjectionFromBothStarts) {
  const NistProblem problem = read_nist(GetParam().name);
  ASSERT_EQ(problem.starts.size(), 2U);
  for (const Eigen::VectorXd& start : problem.starts) {
    expect_certified(problem, solve(problem, true, false, start, GetParam()), 9.0);
  }
}

TEST_P(Nist, IsSolvedByTheFullJacobianFromTheNearStart) {
  const NistProblem problem = read_nist(GetParam().name);
  expect_certified(problem, solve(problem, true, true, problem.starts[1], GetParam()), 9.0);
}

TEST_P(Nist, IsSolvedWithAllParametersNonlinear) {
  const NistProblem problem = read_nist(GetParam().name);
  // The sum of squares of BoxBOD falls from its far start towards b2 → ∞ (it is one of the problems made for that).
  const std::size_t first = problem.name == "BoxBOD" ? 1 : 0;
  for (std::size_t s = first; s < problem.starts.size(); ++s) {
    expect_certified(problem, solve(problem, false, false, problem.starts[s], GetParam()), 7.0);
  }
}

INSTANTIATE_TEST_SUITE_P(StRD, Nist, ::testing::ValuesIn(nist_models()), name_of);

TEST(NistBoxBod, SaysThatItIsLostOnThePlateau) {
  const NistProblem problem = read_nist("BoxBOD");
  for (const NistModel& model : nist_models()) {
    if (model.name == "BoxBOD") {
      const Found found = solve(problem, false, false, problem.starts[0], model);
      EXPECT_GT(found.fit.weighted_rss, 2.0 * problem.rss);
      EXPECT_EQ(found.fit.state[1], ShapeState::flat);
      EXPECT_FALSE(std::isfinite(found.fit.standard_error[1]));
    }
  }
}

}  // namespace
}  // namespace wheelwright::nist_nonlinear_test

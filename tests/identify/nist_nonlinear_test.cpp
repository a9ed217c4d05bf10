// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>

#include "identify/variable_projection.hpp"
#include "tests/identify/nist_models.hpp"

namespace wheelwright::identify::nist_nonlinear_test {
namespace {

using testing_support::digits;
using testing_support::nist_limits;
using testing_support::nist_models;
using testing_support::NistLimits;
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

// The Jacobian with respect to all parameters at the certified solution.
Eigen::MatrixXd jacobian(const NistProblem& problem, const NistModel& model) {
  const NistRegression regression(problem, model, false);
  SeparableValues at;
  EXPECT_TRUE(regression.evaluate(problem.certified, true, at));
  Eigen::MatrixXd J(problem.y.size(), problem.certified.size());
  for (Eigen::Index k = 0; k < J.cols(); ++k) {
    J.col(k) = at.offset_by[static_cast<std::size_t>(k)];
  }
  return J;
}

// The last Gauss-Newton step is a linear least-squares problem. Certified values have 11 digits. Where the search is
// over all parameters it ends as soon as the cost is flat to rounding: residuals r of data y are known to ε‖y‖, the
// cost ‖r‖²/2 relatively to η = 2ε(1 + ‖y‖/‖r‖), and ‖Jδ‖² <= η‖r‖² leaves |δ_j| <= √(η(m − p)) standard deviations;
// ten times that allows for steps that become shorter by a constant factor only. Lanczos1 has exact data: its residuals
// are rounding (certified rss 1.4e-25), so that its standard deviations are too.
void expect_certified(const NistProblem& problem, const NistModel& model, const Found& found, bool by_cost = false) {
  EXPECT_EQ(found.fit.end, SearchEnd::converged);
  const Eigen::VectorXd y = model.log_response ? Eigen::VectorXd(problem.y.array().log()) : problem.y;
  NistLimits limits = nist_limits(jacobian(problem, model), problem, y.norm(), 0.5e-10);
  const double freedom = static_cast<double>(problem.y.size() - problem.certified.size());
  if (by_cost) {
    const double eta = 2.0 * core::kEpsilon * (1.0 + y.norm() / (problem.residual_sd * std::sqrt(freedom)));
    const Eigen::VectorXd flat = 10.0 * std::sqrt(eta * freedom) * problem.certified_sd;
    limits.estimate += flat;
    limits.sd += flat;
  }
  for (Eigen::Index j = 0; j < problem.certified.size(); ++j) {
    EXPECT_LE(std::abs(found.b[j] - problem.certified[j]), limits.estimate[j]) << j;
    // Which says something.
    EXPECT_LE(limits.estimate[j], (by_cost ? 1e-4 : 1e-5) * std::abs(problem.certified[j])) << j;
    if (problem.name != "Lanczos1") {
      EXPECT_LE(std::abs(found.sd[j] - problem.certified_sd[j]), limits.sd[j]) << j;
    }
  }
  if (problem.name != "Lanczos1") {
    EXPECT_LE(std::abs(std::sqrt(found.fit.weighted_rss / freedom) - problem.residual_sd), limits.residual_sd);
  }
  for (const ShapeState state : found.fit.state) {
    EXPECT_EQ(state, ShapeState::identified);
  }
}

TEST_P(Nist, IsSolvedByVariableProjectionFromBothStarts) {
  const NistProblem problem = read_nist(GetParam().name);
  ASSERT_EQ(problem.starts.size(), 2U);
  for (const Eigen::VectorXd& start : problem.starts) {
    expect_certified(problem, GetParam(), solve(problem, true, false, start, GetParam()));
  }
}

TEST_P(Nist, IsSolvedByTheFullJacobianFromTheNearStart) {
  const NistProblem problem = read_nist(GetParam().name);
  expect_certified(problem, GetParam(), solve(problem, true, true, problem.starts[1], GetParam()));
}

TEST_P(Nist, IsSolvedWithAllParametersNonlinear) {
  const NistProblem problem = read_nist(GetParam().name);
  // The sum of squares of BoxBOD falls from its far start towards b2 → ∞ (it is one of the problems made for that).
  const std::size_t first = problem.name == "BoxBOD" ? 1 : 0;
  for (std::size_t s = first; s < problem.starts.size(); ++s) {
    expect_certified(problem, GetParam(), solve(problem, false, false, problem.starts[s], GetParam()), true);
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
}  // namespace wheelwright::identify::nist_nonlinear_test

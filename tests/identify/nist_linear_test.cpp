// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/QR>

#include <wheelwright/core/limits.hpp>
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

// What backward stable least squares can be asked for. The factorisation, and data that are decimals and their powers
// rounded to doubles, amount to other data: each column a_j and the response off by γ of their norm (Higham 2002, theorems
// 19.4 and 20.3), γ = (p + 4√(mp))·ε for m rows of p columns, where roundings partly cancel (Higham and Mary 2019, "A new
// approach to probabilistic rounding error analysis", SIAM J. Sci. Comput. 41; the worst case is of order mp). With
// s_j = √(AᵀA)⁻¹_jj, the length of row j of A⁺, and r the residuals, to first order (Björck 1996, section 1.4.5)
//
//     |δx_j| <= γ(s_j t + Σ_k |(AᵀA)⁻¹_jk| ‖a_k‖ ‖r‖),    t = ‖y‖ + Σ_k ‖a_k‖ |x_k|,
//     |δσ| <= γ(t + Σ_k s_k ‖a_k‖ ‖r‖) / √(m − p),           |δs_j| <= 2γ s_j Σ_k s_k ‖a_k‖,
//
// Σ_k s_k ‖a_k‖ being a condition number (p where columns are orthogonal). NIST certifies 15 digits.
struct Limits {
  Eigen::VectorXd estimate, sd;  // absolute
  double residual_sd = 0.0;
};

Limits limits_of(const NistProblem& problem) {
  using Long = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
  const Eigen::MatrixXd Y = columns_of(problem);
  const Eigen::Index p = Y.cols();
  const auto freedom = static_cast<double>(Y.rows() - p);
  const double gamma =
      (static_cast<double>(p) + 4.0 * std::sqrt(static_cast<double>(Y.rows() * p))) * kEpsilon;
  const Eigen::VectorXd norm = Y.colwise().norm(), x = problem.certified.cwiseAbs();
  const Long scaled = Y.cast<long double>() * norm.cast<long double>().cwiseInverse().asDiagonal();
  const Long R = Long(scaled.householderQr().matrixQR().topRows(p)).triangularView<Eigen::Upper>();
  const Long inverse = R.triangularView<Eigen::Upper>().solve(Long::Identity(p, p));
  const Eigen::MatrixXd gram = (inverse * inverse.transpose()).cast<double>();  // of columns of norm 1
  const Eigen::VectorXd length = gram.diagonal().cwiseSqrt();
  const double t = problem.y.norm() + norm.dot(x), residual = problem.residual_sd * std::sqrt(freedom);
  constexpr double published = 0.5e-14;
  Limits limits;
  limits.estimate =
      (gamma * (length * t + gram.cwiseAbs().rowwise().sum() * residual)).cwiseQuotient(norm) + published * x;
  limits.residual_sd = gamma * (t + length.sum() * residual) / std::sqrt(freedom) + published * problem.residual_sd;
  limits.sd = limits.residual_sd * length.cwiseQuotient(norm) +
              (2.0 * gamma * length.sum() + published) * problem.certified_sd;
  return limits;
}

class NistLinear : public ::testing::TestWithParam<const char*> {};

TEST_P(NistLinear, IsAsNearToTheCertifiedValuesAsTheirConditionAllows) {
  const NistProblem problem = read_nist(GetParam());
  const Solved solved = solve(problem);
  const Limits limits = limits_of(problem);
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
                         ::testing::Values("Norris", "Pontius", "Longley", "Wampler1", "Wampler2", "Wampler3", "Wampler4",
                                           "Wampler5", "Filip"),
                         [](const auto& problem) { return std::string(problem.param); });

}  // namespace
}  // namespace wheelwright::nist_linear_test

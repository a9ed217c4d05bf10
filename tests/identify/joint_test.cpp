// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <memory>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/QR>
#include <boost/math/distributions/students_t.hpp>

#include <wheelwright/core/error.hpp>
#include <wheelwright/identify/joint.hpp>
#include <wheelwright/identify/residual_statistics.hpp>

#include "support/random.hpp"
#include "support/rows.hpp"

namespace wheelwright::joint_test {
namespace {

using ::testing::HasSubstr;
using testing_support::Autoregression;
using testing_support::block_of;
using testing_support::Random;

struct Log {
  Eigen::MatrixXd Y;
  Eigen::VectorXd y;
  std::unique_ptr<RegressionTable> rows;
};

Log log_of(const Eigen::MatrixXd& Y, const Eigen::VectorXd& y, std::size_t outputs = 2) {
  return {Y, y, std::make_unique<RegressionTable>(block_of(Y, y, outputs))};
}

const std::vector<JointParameter> mass_shared = {{"mass", true}, {"inertia", false}, {"friction", true}};

TEST(JointFit, IsTheFitToAllRowsStackedByHand) {
  Random random(1);
  const Eigen::Vector3d extra(0.7, 0.0, 0.0);  // r·Δm
  const Eigen::Vector2d weights(1.0, 3.0);
  std::vector<Log> logs;
  for (int l = 0; l < 3; ++l) {
    const Eigen::MatrixXd Y = random.matrix(200 + 100 * l, 3);
    logs.push_back(log_of(Y, Y * (Eigen::Vector3d(2.0, 1.0 + l, 0.5) + l * extra) + random.matrix(Y.rows(), 1)));
  }
  std::vector<JointLog> input;
  for (std::size_t l = 0; l < 3; ++l) {
    input.push_back(
        {std::string(1, static_cast<char>('a' + l)), logs[l].rows.get(), static_cast<double>(l) * extra, weights});
  }
  const JointFit fit = joint_fit(input, mass_shared);

  // φ = (mass, inertia a, b, c, friction).
  EXPECT_EQ(fit.unknowns, (std::vector<std::string>{"mass", "inertia (a)", "inertia (b)", "inertia (c)", "friction"}));
  Eigen::MatrixXd stack(900, 5);
  stack.setZero();
  Eigen::VectorXd right(900);
  Eigen::Index at = 0;
  for (std::size_t l = 0; l < 3; ++l) {
    for (Eigen::Index row = 0; row < logs[l].Y.rows(); ++row, ++at) {
      const double w = weights[row % 2];
      stack(at, 0) = w * logs[l].Y(row, 0);
      stack(at, static_cast<Eigen::Index>(1 + l)) = w * logs[l].Y(row, 1);
      stack(at, 4) = w * logs[l].Y(row, 2);
      right[at] = w * (logs[l].y[row] - static_cast<double>(l) * extra[0] * logs[l].Y(row, 0));
    }
  }
  const Eigen::VectorXd expected = stack.householderQr().solve(right);
  EXPECT_LT((fit.unknown - expected).norm(), 1e-12 * expected.norm());
  EXPECT_NEAR(fit.weighted_rss, (right - stack * expected).squaredNorm(), 1e-11 * right.squaredNorm());
  EXPECT_EQ(fit.rank, 5);
  EXPECT_EQ(fit.instants, 450u);
  for (Eigen::Index l = 0; l < 3; ++l) {
    EXPECT_NEAR(fit.theta(0, l), expected[0] + 0.7 * static_cast<double>(l), 1e-11);
    EXPECT_NEAR(fit.theta(1, l), expected[1 + l], 1e-11);
  }
}

TEST(JointFit, OfOneLogIsItsOwnFitAndCovariance) {
  Random random(2);
  const Eigen::MatrixXd Y = random.matrix(4000, 2);
  const Log log = log_of(Y, Y * Eigen::Vector2d(1.0, -1.0) + random.matrix(4000, 1), 1);
  const JointFit fit = joint_fit({{"a", log.rows.get(), {}, {}}}, {{"x", true}, {"y", true}});
  const LeastSquaresFit own = least_squares(*log.rows);
  ResidualStatistics statistics(own.estimate, Eigen::VectorXd::Ones(1));
  statistics.add(log.rows->block());
  const ResidualSummary summary = statistics.summary(own.inverse_gram);
  EXPECT_LT((fit.unknown - own.estimate).norm(), 1e-13);
  EXPECT_LT((fit.covariance - summary.covariance).norm(), 1e-9 * summary.covariance.norm());
  EXPECT_NEAR(fit.freedom[0], summary.freedom, 1e-9 * summary.freedom);
  EXPECT_FALSE(fit.sharing[0].tested);
  EXPECT_TRUE(fit.compatible);
}

// For two logs Welch's F is the squared t statistic of the difference, with Satterthwaite's degrees of freedom.
TEST(JointFit, SharingOfTwoLogsIsATTest) {
  Random random(3);
  std::vector<Log> logs;
  for (int l = 0; l < 2; ++l) {
    const Eigen::MatrixXd Y = random.matrix(1000 + 2000 * l, 1);
    logs.push_back(log_of(Y, Y + (1.0 + l) * random.matrix(Y.rows(), 1), 1));
  }
  const JointFit fit =
      joint_fit({{"a", logs[0].rows.get(), {}, {}}, {"b", logs[1].rows.get(), {}, {}}}, {{"mass", true}});
  const SharingTest& test = fit.sharing[0];
  const double v0 = std::pow(test.standard_error[0], 2), v1 = std::pow(test.standard_error[1], 2);
  const double t = (test.estimate[0] - test.estimate[1]) / std::sqrt(v0 + v1);
  EXPECT_NEAR(test.statistic, t * t, 1e-10 * t * t);
  const JointFit one = joint_fit({{"a", logs[0].rows.get(), {}, {}}}, {{"mass", true}});
  const JointFit two = joint_fit({{"b", logs[1].rows.get(), {}, {}}}, {{"mass", true}});
  const double freedom = (v0 + v1) * (v0 + v1) / (v0 * v0 / one.freedom[0] + v1 * v1 / two.freedom[0]);
  EXPECT_NEAR(test.freedom_within, freedom, 1e-9 * freedom);
  const double p = 2.0 * boost::math::cdf(boost::math::complement(boost::math::students_t(freedom), std::abs(t)));
  EXPECT_NEAR(test.p_value, p, 1e-9);
}

// Three logs of the same robot with residuals that remember a quarter of a second: the test must reject at its level,
// and the joint interval must cover. 400 runs: the binomial standard deviation at 5 % is 1.1 %.
TEST(JointFit, LevelsAreHonestUnderAutocorrelatedResiduals) {
  constexpr int runs = 400;
  constexpr Eigen::Index count = 3000;
  int rejected = 0, covered = 0;
  for (int run = 0; run < runs; ++run) {
    std::vector<Log> logs;
    std::vector<JointLog> input;
    for (int l = 0; l < 3; ++l) {
      Autoregression noise(static_cast<std::uint64_t>(7 + 3 * run + l), 0.9);
      const Eigen::MatrixXd Y = Eigen::MatrixXd::NullaryExpr(count, 1, [&](Eigen::Index k, Eigen::Index) {
        return std::sin(0.01 * (1.0 + 0.3 * l) * static_cast<double>(k));
      });
      const Eigen::VectorXd e = Eigen::VectorXd::NullaryExpr(count, [&] { return noise.next(); });
      logs.push_back(log_of(Y, 2.0 * Y + (1.0 + l) * e, 1));
      input.push_back({"log", logs.back().rows.get(), {}, {}});
    }
    const JointFit fit = joint_fit(input, {{"mass", true}});
    rejected += fit.compatible ? 0 : 1;
    const double t = boost::math::quantile(boost::math::students_t(fit.freedom[0]), 0.975);
    covered += std::abs(fit.unknown[0] - 2.0) <= t * fit.standard_error[0] ? 1 : 0;
  }
  RecordProperty("rejected", rejected);
  RecordProperty("covered", covered);
  const double three = 3.0 * std::sqrt(0.05 * 0.95 / runs);
  EXPECT_NEAR(static_cast<double>(rejected) / runs, 0.05, three);
  EXPECT_NEAR(static_cast<double>(covered) / runs, 0.95, three);
}

TEST(JointFit, SaysWhichParameterIsNotShared) {
  Random random(5);
  std::vector<Log> logs;
  for (int l = 0; l < 2; ++l) {
    const Eigen::MatrixXd Y = random.matrix(2000, 3);
    // The second log carries a payload that nobody told of.
    logs.push_back(log_of(Y, Y * Eigen::Vector3d(2.0 + 0.5 * l, 1.0, 0.3) + 0.1 * random.matrix(2000, 1)));
  }
  const std::vector<JointParameter> all = {{"mass", true}, {"inertia", true}, {"friction", true}};
  std::vector<JointLog> input = {{"empty", logs[0].rows.get(), {}, {}}, {"loaded", logs[1].rows.get(), {}, {}}};
  const JointFit blind = joint_fit(input, all);
  EXPECT_FALSE(blind.compatible);
  EXPECT_THAT(blind.sharing[0].words, HasSubstr("mass: the logs disagree"));
  EXPECT_THAT(blind.sharing[0].words, HasSubstr("in empty"));
  EXPECT_THAT(blind.sharing[1].words, HasSubstr("inertia: the logs agree"));
  input[1].addition = Eigen::Vector3d(0.5, 0.0, 0.0);
  const JointFit told = joint_fit(input, all);
  EXPECT_TRUE(told.compatible) << told.sharing[0].words;
}

TEST(JointFit, ALogThatDoesNotKnowAParameterBorrowsIt) {
  Random random(6);
  Eigen::MatrixXd straight = random.matrix(600, 2);
  straight.col(1).setZero();
  const Eigen::MatrixXd curves = random.matrix(600, 2);
  const Eigen::Vector2d truth(1.0, 2.0);
  const Log a = log_of(straight, straight * truth, 1), b = log_of(curves, curves * truth, 1);
  const JointFit fit =
      joint_fit({{"a", a.rows.get(), {}, {}}, {"b", b.rows.get(), {}, {}}}, {{"mass", true}, {"inertia", true}});
  EXPECT_EQ(fit.rank, 2);
  EXPECT_LT((fit.unknown - truth).norm(), 1e-12);
  EXPECT_FALSE(fit.sharing[1].tested);
  EXPECT_THAT(fit.sharing[1].words, HasSubstr("cannot be tested"));
}

TEST(JointFit, MisuseIsRefused) {
  const Log log = log_of(Eigen::MatrixXd::Ones(4, 2), Eigen::VectorXd::Ones(4), 1);
  const std::vector<JointParameter> two = {{"x", true}, {"y", true}};
  EXPECT_THROW((void)joint_fit({}, two), InvalidArgument);
  EXPECT_THROW((void)joint_fit({{"a", nullptr, {}, {}}}, two), InvalidArgument);
  EXPECT_THROW((void)joint_fit({{"a", log.rows.get(), {}, {}}}, {{"x", true}}), InvalidArgument);
  EXPECT_THROW((void)joint_fit({{"a", log.rows.get(), Eigen::Vector3d::Zero(), {}}}, two), InvalidArgument);
  EXPECT_THROW((void)joint_fit({{"a", log.rows.get(), {}, Eigen::Vector2d::Ones()}}, two), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::joint_test

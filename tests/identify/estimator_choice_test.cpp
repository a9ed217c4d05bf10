// SPDX-License-Identifier: Apache-2.0
#include "core/statistics.hpp"
#include "identify/estimate.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "identify/noise_level.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::identify::estimator_choice_test {
namespace {

using testing_support::block_of;
using testing_support::Random;

// y = Xθ + e, measured Y = X + noise, instruments Z = c·X + noise of their own.
struct Log {
  double noise_of_Y = 0.0, noise_of_Z = 0.3, noise_of_y = 0.1, follow = 1.0;
  Eigen::Index rows = 4000;
  std::uint64_t seed = 1;

  [[nodiscard]] RegressionMoments moments(bool instruments) const {
    Random random(seed);
    const auto normal = [&](Eigen::Index columns) -> Eigen::MatrixXd {
      return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
    };
    const Eigen::MatrixXd X = normal(2), Y = X + noise_of_Y * normal(2), Z = follow * X + noise_of_Z * normal(2);
    const Eigen::VectorXd y = X * theta() + noise_of_y * normal(1);
    Eigen::MatrixXd both(rows, 4);
    both << Y, Z;
    RegressionMoments sums(1, 2, instruments);
    sums.add(block_of(instruments ? both : Y, y, 1));
    return sums;
  }
  [[nodiscard]] RowNoise noise() const { return {{noise_of_Y * noise_of_Y * Eigen::Matrix2d::Identity()}, {}, 0.0}; }
  static Eigen::VectorXd theta() { return Eigen::Vector2d(2.0, -1.0); }
};

EstimatorEvidence evidence(const Log& log, bool commands, bool noise_known) {
  EstimatorEvidence e{.rows = log.moments(commands), .simulate = {}, .noise = {}, .noise_origin = "as put in"};
  if (noise_known) {
    e.noise = log.noise();
  }
  return e;
}

std::optional<RegressionMoments> simulated(const Log& log) { return log.moments(true); }

TEST(EstimatorChoice, IsLeastSquaresWhereNoiseDoesNotMatter) {
  const EstimatorChoice choice = choose_estimator(evidence({.noise_of_Y = 1e-4}, false, true));
  EXPECT_EQ(choice.best().estimator, Estimator::least_squares);
  EXPECT_FALSE(choice.in_doubt);
  EXPECT_LE(choice.predicted_bias.cwiseAbs().maxCoeff(), 0.1);
}

TEST(EstimatorChoice, TakesTheCommandedMotionFirst) {
  const Log log{.noise_of_Y = 0.5};
  for (const bool known : {true, false}) {
    const EstimatorChoice choice = choose_estimator(evidence(log, true, known));
    EXPECT_EQ(choice.best().estimator, Estimator::instrumental_variables);
    EXPECT_EQ(choice.candidates[choice.chosen].origin, "the commanded motion");
    ASSERT_TRUE(choice.tested_against);
    EXPECT_LT(choice.test.p_value, 1e-6);
  }
}

TEST(EstimatorChoice, CompensatesAKnownNoiseButNotALimit) {
  const Log log{.noise_of_Y = 0.5};
  EstimatorEvidence e = evidence(log, false, true);
  EXPECT_EQ(choose_estimator(e).best().estimator, Estimator::bias_compensated);
  EXPECT_FALSE(choose_estimator(e).tested_against);
  e.noise_is_limit = true;
  const EstimatorChoice doubt = choose_estimator(e);
  EXPECT_EQ(doubt.best().estimator, Estimator::least_squares);
  EXPECT_TRUE(doubt.in_doubt);
  e.simulate = [&](const Eigen::VectorXd&) { return simulated(log); };
  EXPECT_EQ(choose_estimator(e).best().estimator, Estimator::instrumental_variables);
}

TEST(EstimatorChoice, PrefersASimulationWhereEffortsAreExact) {
  const Log log{.noise_of_Y = 0.5};
  EstimatorEvidence e = evidence(log, false, true);
  e.simulate = [&](const Eigen::VectorXd&) { return simulated(log); };
  EXPECT_EQ(choose_estimator(e).best().estimator, Estimator::bias_compensated);
  e.effort_is_exact = true;
  EXPECT_EQ(choose_estimator(e).best().estimator, Estimator::instrumental_variables);
}

TEST(EstimatorChoice, SaysThatItIsInDoubtAndWhy) {
  const EstimatorChoice nothing = choose_estimator(evidence({.noise_of_Y = 0.5}, false, false));
  EXPECT_TRUE(nothing.in_doubt);
  EXPECT_NE(nothing.reason.find("log the commanded speeds"), std::string::npos) << nothing.reason;
  const EstimatorChoice idle = choose_estimator(evidence({.noise_of_Y = 0.5, .follow = 0.0}, true, false));
  EXPECT_TRUE(idle.in_doubt);
  EXPECT_EQ(idle.reason.find("log the commanded speeds"), std::string::npos) << idle.reason;
  EXPECT_NE(idle.reason.find("the commanded motion"), std::string::npos) << idle.reason;
}

// Noise ten times the motion leaves 1 % of the variance of Y to the instruments, but every bit as surely: the estimate
// must not be refused, and keeps its intervals.
TEST(EstimatorChoice, DoesNotTakeNoiseOfTheMotionForWeakInstruments) {
  constexpr int runs = 200;
  double covered = 0.0;
  for (int run = 0; run < runs; ++run) {
    const Log log{.noise_of_Y = 10.0, .noise_of_Z = 0.1, .rows = 20000, .seed = 100 + static_cast<std::uint64_t>(run)};
    const EstimatorChoice choice = choose_estimator(evidence(log, true, false));
    ASSERT_EQ(choice.best().estimator, Estimator::instrumental_variables);
    EXPECT_LT(choice.candidates[choice.chosen].strength.maxCoeff(), 0.05);
    const double t = core::student_quantile(0.95, choice.best().freedom);
    for (Eigen::Index j = 0; j < 2; ++j) {
      covered += std::abs(choice.best().theta[j] - Log::theta()[j]) <= t * choice.best().standard_error[j] ? 0.5 : 0.0;
    }
  }
  // Binomial, 0.95 ± 3.5·0.0154 if both parameters went together.
  EXPECT_NEAR(covered / runs, 0.95, 3.5 * 0.0154);
}

TEST(EstimatorChoice, PredictsTheBiasOfLeastSquares) {
  const Log log{.noise_of_Y = 0.5, .rows = 100000};
  const EstimatorChoice choice = choose_estimator(evidence(log, false, true));
  const Estimate& squares = choice.candidates.front().estimate;
  for (Eigen::Index j = 0; j < 2; ++j) {
    const double bias = squares.theta[j] - Log::theta()[j];
    EXPECT_NEAR(choice.predicted_bias[j] * squares.standard_error[j], bias, 0.05 * std::abs(bias));
  }
  const EstimatorChoice drowned = choose_estimator(evidence({.noise_of_Y = 100.0, .rows = 1000}, false, true));
  EXPECT_FALSE(drowned.predicted_bias.cwiseAbs().maxCoeff() < 1.0);
}

TEST(SharedNoise, IsSeenInCommandsMadeFromTheMeasurement) {
  Random random(5);
  LogTable log;
  log.names = {"command", "speed", "copy", "fed_back"};
  log.columns.resize(4);
  double before = 0.0;
  for (int k = 0; k < 4000; ++k) {
    const double t = 0.01 * k;
    const double motion = std::sin(t) + 0.3 * std::sin(3.0 * t);
    const double speed = motion + 0.02 * random.normal();
    log.t.push_back(t);
    log.columns[0].push_back(std::round(motion * 4.0) / 4.0);  // in steps
    log.columns[1].push_back(speed);
    log.columns[2].push_back(speed);
    log.columns[3].push_back(motion + 0.5 * (motion - before));
    before = speed;
  }
  TableSource source(log);
  EXPECT_FALSE(share_noise(source, {"command"}, {"speed"}));
  EXPECT_TRUE(share_noise(source, {"copy"}, {"speed"}));
  EXPECT_TRUE(share_noise(source, {"fed_back"}, {"speed"}));
}

}  // namespace
}  // namespace wheelwright::identify::estimator_choice_test

// SPDX-License-Identifier: Apache-2.0
#include "core/statistics.hpp"
#include "identify/inference/regions.hpp"

#include <cmath>
#include <functional>
#include <limits>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "core/error.hpp"
#include "identify/noise_level.hpp"
#include "tests/support/random.hpp"
#include "tests/support/rows.hpp"

namespace wheelwright::inference::sign_perturbed_sums_test {

using identify::RegressionMoments;

namespace {

using testing_support::block_of;
using testing_support::Random;

const Eigen::Vector2d kTheta(1.0, -2.0);

// `count` independent observations, each in a block of time of its own: moments keep four instants a block, three are
// empty. Noise grows with a heavy-tailed regressor.
RegressionMoments observations(Random& random, int count, const std::function<double(Random&)>& noise) {
  Eigen::MatrixXd Y = Eigen::MatrixXd::Zero(4 * count, 2);
  Eigen::VectorXd y = Eigen::VectorXd::Zero(4 * count);
  for (Eigen::Index k = 0; k < 4 * count; k += 4) {
    Y(k, 0) = std::pow(random.normal(), 3.0);
    Y(k, 1) = 1.0;
    y[k] = Y.row(k) * kTheta + noise(random) * (1.0 + std::abs(Y(k, 0)));
  }
  RegressionMoments moments(1, 2);
  moments.add(block_of(Y, y, 1));
  return moments;
}

SignPerturbedOptions sign_per_block(std::uint64_t seed, std::size_t sums, double confidence) {
  SignPerturbedOptions options;
  options.seconds = 0.04;
  options.seed = seed;
  options.sums = sums;
  options.confidence = confidence;
  return options;
}

// 2000 runs: the share of a binomial of p = 0.95 has a standard deviation of 0.49 %; four of them are allowed.
TEST(SignPerturbedSums, HaveTheirProbabilityWithFewHeavyTailedErrorsWhereStudentDoesNot) {
  const std::function<double(Random&)> noises[] = {
      [](Random& r) { return r.laplace(); },
      [](Random& r) { return r.normal() / r.normal(); },  // Cauchy: no mean, no variance
  };
  constexpr int runs = 2000;
  for (const auto& noise : noises) {
    int members = 0;
    int student = 0;
    for (int run = 0; run < runs; ++run) {
      Random random(static_cast<std::uint64_t>(run) + 1);
      const RegressionMoments moments = observations(random, 25, noise);
      const SignPerturbedSums sums(moments, sign_per_block(static_cast<std::uint64_t>(run) + 5000, 60, 0.95));
      EXPECT_EQ(sums.groups(), 25U);
      EXPECT_EQ(sums.probability(), 0.95);
      members += sums.contains(kTheta) ? 1 : 0;
      const identify::Estimate e = identify::ordinary_least_squares(moments);
      student += std::abs(e.theta[0] - 1.0) <= core::student_quantile(0.95, e.freedom) * e.standard_error[0] ? 1 : 0;
    }
    EXPECT_NEAR(static_cast<double>(members) / runs, 0.95, 0.0195);
    EXPECT_LT(static_cast<double>(student) / runs, 0.93);
  }
}

// With two groups half of all perturbed sums are ± the sum itself: without random order among ties the share would be
// 0 or 1.
TEST(SignPerturbedSums, HaveTheirProbabilityUnderTies) {
  constexpr int runs = 2000;
  int members = 0;
  for (int run = 0; run < runs; ++run) {
    Random random(static_cast<std::uint64_t>(run) + 1);
    const RegressionMoments moments = observations(random, 2, [](Random& r) { return r.laplace(); });
    members += SignPerturbedSums(moments, sign_per_block(static_cast<std::uint64_t>(run), 10, 0.8)).contains(kTheta);
  }
  EXPECT_NEAR(static_cast<double>(members) / runs, 0.8, 4.0 * std::sqrt(0.8 * 0.2 / runs));
}

TEST(SignPerturbedSums, HoldAllMembersInTheirBounds) {
  Random random(3);
  for (int world = 0; world < 5; ++world) {
    const RegressionMoments moments = observations(random, 40, [](Random& r) { return r.laplace(); });
    const SignPerturbedSums sums(moments, sign_per_block(static_cast<std::uint64_t>(world), 100, 0.95));
    const SignPerturbedBounds bounds = sums.bounds();
    ASSERT_TRUE(bounds.lower.allFinite() && bounds.upper.allFinite());
    EXPECT_TRUE(sums.contains(sums.centre()));
    const Eigen::MatrixXd inverse = bounds.H.inverse();
    int members = 0;
    for (int sample = 0; sample < 3000; ++sample) {
      const Eigen::Vector2d offset = (bounds.upper - bounds.lower).cwiseProduct(random.matrix(2, 1));
      const Eigen::Vector2d theta = sums.centre() + offset;
      if (!sums.contains(theta)) {
        continue;
      }
      ++members;
      EXPECT_TRUE((theta.array() >= bounds.lower.array()).all() && (theta.array() <= bounds.upper.array()).all());
      EXPECT_LE(offset.dot(bounds.H * offset), bounds.radius);
    }
    EXPECT_GT(members, 100);
    for (Eigen::Index j = 0; j < 2; ++j) {
      const double reach = std::sqrt(bounds.radius * inverse(j, j)) * (1.0 + 1e-12);
      EXPECT_LE(bounds.upper[j] - sums.centre()[j], reach);
      EXPECT_LE(sums.centre()[j] - bounds.lower[j], reach);
    }
  }
}

// For one parameter every ‖S_0‖ <= ‖S_i‖ is an interval round θ̂, so the region is the interval between the q-th
// largest ends: bounds are the region, and its ends can be found by halving.
TEST(SignPerturbedSums, AreTheirBoundsForOneParameter) {
  Random random(4);
  for (int world = 0; world < 5; ++world) {
    const Eigen::MatrixXd Y = random.matrix(120, 1);
    const Eigen::VectorXd y = 3.0 * Y.col(0) + random.matrix(120, 1);
    RegressionMoments moments(1, 1);
    moments.add(block_of(Y, y, 1));
    const SignPerturbedSums sums(moments, sign_per_block(static_cast<std::uint64_t>(world), 100, 0.9));
    const SignPerturbedBounds bounds = sums.bounds();
    const double centre = sums.centre()[0];
    for (const double bound : {bounds.lower[0], bounds.upper[0]}) {
      double inside = centre;
      double outside = centre + 3.0 * (bound - centre);
      ASSERT_FALSE(sums.contains(Eigen::VectorXd::Constant(1, outside)));
      for (int step = 0; step < 60; ++step) {
        const double middle = 0.5 * (inside + outside);
        (sums.contains(Eigen::VectorXd::Constant(1, middle)) ? inside : outside) = middle;
      }
      EXPECT_NEAR(inside, bound, 1e-10 * std::abs(bound - centre));
    }
    const double reach = std::max(bounds.upper[0] - centre, centre - bounds.lower[0]);
    EXPECT_GE(bounds.radius, bounds.H(0, 0) * reach * reach * (1.0 - 1e-9));
    // At most q − 1 upper and q − 1 lower ends lie further out: the (2q − 1)-th largest ‖S_0‖² is no larger. Holds only
    // where the search for ξ has found the minimum.
    const SignPerturbedSums wider(moments, sign_per_block(static_cast<std::uint64_t>(world), 100, 0.81));
    EXPECT_LE(wider.bounds().radius, bounds.H(0, 0) * reach * reach * (1.0 + 1e-6));
  }
}

// Noise in the regressor biases least squares by 1/(1 + 0.64) − 1 = −39 %; with instruments the probability stays
// exact.
TEST(SignPerturbedSums, StayExactUnderErrorsInVariablesWithInstruments) {
  constexpr int runs = 1000;
  int with = 0;
  int without = 0;
  for (int run = 0; run < runs; ++run) {
    Random random(static_cast<std::uint64_t>(run) + 1);
    const Eigen::MatrixXd X = Eigen::MatrixXd::NullaryExpr(160, 1, [&] { return random.normal(); });
    Eigen::MatrixXd rows(160, 2);
    Eigen::VectorXd y(160);
    for (Eigen::Index k = 0; k < 160; ++k) {
      rows(k, 0) = X(k, 0) + 0.8 * random.laplace();
      rows(k, 1) = X(k, 0) + 0.3 * random.normal();
      y[k] = X(k, 0) + 0.2 * random.laplace();
    }
    RegressionMoments moments(1, 1, true);
    moments.add(block_of(rows, y, 1));
    SignPerturbedOptions options = sign_per_block(static_cast<std::uint64_t>(run), 40, 0.9);
    const Eigen::VectorXd truth = Eigen::VectorXd::Ones(1);
    with += SignPerturbedSums(moments, options).contains(truth) ? 1 : 0;
    options.instruments = false;
    without += SignPerturbedSums(moments, options).contains(truth) ? 1 : 0;
  }
  EXPECT_NEAR(static_cast<double>(with) / runs, 0.9, 4.0 * std::sqrt(0.9 * 0.1 / runs));
  EXPECT_LT(static_cast<double>(without) / runs, 0.2);
}

TEST(SignPerturbedSums, ChooseGroupsThatOutlastTheMemoryOfTheErrors) {
  for (const double phi : {0.0, 0.9}) {
    testing_support::Autoregression error(5, phi), motion(6, 0.9);
    Eigen::MatrixXd Y(8000, 1);
    Eigen::VectorXd y(8000);
    for (Eigen::Index k = 0; k < 8000; ++k) {
      Y(k, 0) = motion.next();
      y[k] = Y(k, 0) + error.next();
    }
    RegressionMoments moments(1, 1);
    moments.add(block_of(Y, y, 1));
    const SignPerturbedSums sums(moments);
    // Scores have the correlation φ·0.9: Σ|k|R(k)/ΣR(k) is 2ρ/(1 − ρ²) = 4.7 instants for φ = 0.9, twenty times of
    // which are 0.94 s, in blocks of 0.04 s.
    EXPECT_GE(sums.group_seconds(), phi > 0.0 ? 0.5 : 0.039);
    EXPECT_LE(sums.group_seconds(), phi > 0.0 ? 1.9 : 0.21);
    EXPECT_LE(sums.edge_share(), 0.05);
  }
}

TEST(SignPerturbedSums, SayWhenTheyCannotBeHad) {
  Random random(7);
  Eigen::MatrixXd Y = random.matrix(200, 2);
  Y.col(1) = 2.0 * Y.col(0);
  RegressionMoments moments(1, 2);
  moments.add(block_of(Y, random.matrix(200, 1), 1));
  const SignPerturbedSums sums(moments);
  EXPECT_FALSE(sums.usable());
  EXPECT_FALSE(sums.reason().empty());
  EXPECT_TRUE(sums.contains(Eigen::Vector2d(1e9, 0.0)));
  EXPECT_EQ(sums.bounds().upper[0], std::numeric_limits<double>::infinity());
  SignPerturbedOptions few;
  few.sums = 10;
  EXPECT_THROW(SignPerturbedSums(moments, few), InvalidArgument);
}

// A parameter that is held at zero leaves the region that the others have without its column.
TEST(SignPerturbedSums, LeaveParametersOut) {
  Random random(8);
  const Eigen::MatrixXd Y = random.matrix(400, 2);
  const Eigen::VectorXd y = Y.col(1) + 0.3 * random.matrix(400, 1);
  RegressionMoments both(1, 2), alone(1, 1);
  both.add(block_of(Y, y, 1));
  alone.add(block_of(Y.rightCols(1), y, 1));
  SignPerturbedOptions options = sign_per_block(1, 100, 0.95);
  const SignPerturbedBounds expected = SignPerturbedSums(alone, options).bounds();
  options.estimator.excluded = {true, false};
  const SignPerturbedBounds bounds = SignPerturbedSums(both, options).bounds();
  EXPECT_EQ(bounds.upper[0], 0.0);
  EXPECT_NEAR(bounds.upper[1], expected.upper[0], 1e-12);
  EXPECT_NEAR(bounds.lower[1], expected.lower[0], 1e-12);
}

}  // namespace
}  // namespace wheelwright::inference::sign_perturbed_sums_test

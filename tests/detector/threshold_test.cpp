// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include <wheelwright/core/error.hpp>
#include <wheelwright/detector/threshold.hpp>

#include "support/random.hpp"

namespace wheelwright::threshold_test {
namespace {

using testing_support::Random;

HalfSpace half_space(const Eigen::VectorXd& a, double b) { return {a, b, {}}; }

// A box cut by half-spaces around the point (1, …, 1), which stays inside.
Polytope random_polytope(std::uint64_t seed, Eigen::Index p, double lowest) {
  Random random(seed);
  std::vector<HalfSpace> rows;
  for (int k = 0; k < 12; ++k) {
    const Eigen::VectorXd a = random.matrix(p, 1);
    rows.push_back(half_space(a, a.sum() + 0.3 * random.unit()));
  }
  Box box;
  box.sides.assign(static_cast<std::size_t>(p), {lowest, 4.0});
  return Polytope(rows, box);
}

struct Row {
  std::vector<double> y, dy;
  double output;
};

Row random_row(Random& random, std::size_t p, double error) {
  Row row;
  for (std::size_t j = 0; j < p; ++j) {
    row.y.push_back(3.0 * random.symmetric());
    row.dy.push_back(error * random.unit());
  }
  row.output = error * random.unit();
  return row;
}

TEST(Threshold, OfABoxIsTheSignPattern) {
  // θ ∈ [1, 2] × [3, 5], θ̂ = (1.5, 4): y = (2, −1), Δ = (0.1, 0.2), n̄ = 0.5.
  Box box;
  box.sides = {{1.0, 2.0}, {3.0, 5.0}};
  const ThresholdRule rule(Polytope({}, box), Eigen::Vector2d(1.5, 4.0), ParameterSetKind::box);
  const Threshold t = rule.at(std::array{2.0, -1.0}, std::array{0.1, 0.2}, 0.5);
  // h(y + Δ) = 2.1·2 − 0.8·3 = 1.8; h(−y + Δ) = −1.9·1 + 1.2·5 = 4.1; yθ̂ = −1.
  EXPECT_NEAR(t.upper, 1.8 + 1.0 + 0.5, 1e-12);
  EXPECT_NEAR(t.lower, -4.1 + 1.0 - 0.5, 1e-12);
  EXPECT_EQ(t.rho(), std::max(t.upper, -t.lower));
  EXPECT_EQ(t.width(), t.upper - t.lower);
  const Interval range = rule.prediction(std::array{2.0, -1.0});
  EXPECT_NEAR(range.lower, -3.0, 1e-12);
  EXPECT_NEAR(range.upper, 1.0, 1e-12);
}

TEST(Threshold, OfParametersOfEitherSignAllowsForBoth) {
  Box box;
  box.sides = {{-2.0, 1.0}, {-3.0, -1.0}};
  const ThresholdRule rule(Polytope({}, box), Eigen::Vector2d(0.0, -2.0), ParameterSetKind::box);
  const Threshold t = rule.at(std::array{1.0, 1.0}, std::array{0.25, 0.5}, 0.0);
  // θ1: y θ1 ∈ [−2, 1] and Δ|θ1| <= 0.5; θ2 <= 0: (y − Δ)θ2 <= −0.5, (y + Δ)θ2 >= −4.5. yθ̂ = −2.
  EXPECT_NEAR(t.upper, 1.0 + 0.5 - 0.5 + 2.0, 1e-12);
  EXPECT_NEAR(t.lower, -2.0 - 0.5 - 4.5 + 2.0, 1e-12);
}

TEST(Threshold, OfThePolytopeIsNeverLooserThanOfItsBox) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const Eigen::Index p = 2 + static_cast<Eigen::Index>(seed % 3);
    const Polytope set = random_polytope(seed, p, seed % 2 == 0 ? 0.0 : -4.0);
    const Eigen::VectorXd estimate = Eigen::VectorXd::Ones(p) + 0.5 * Random(seed).matrix(p, 1);
    const ThresholdRule polytope(set, estimate), box(set, estimate, ParameterSetKind::box);
    Random random(seed + 1000);
    int tighter = 0;
    for (int k = 0; k < 200; ++k) {
      const Row row = random_row(random, static_cast<std::size_t>(p), k % 2 == 0 ? 0.0 : 0.2);
      const Threshold a = polytope.at(row.y, row.dy, row.output), b = box.at(row.y, row.dy, row.output);
      EXPECT_LE(a.rho(), b.rho());
      EXPECT_GE(a.lower, b.lower);
      EXPECT_LE(a.upper, b.upper);
      tighter += a.width() < 0.9 * b.width() ? 1 : 0;
    }
    EXPECT_GT(tighter, 0);
  }
}

// Fault-free: θ in the set, |Y° − Y| <= Δ and |n| <= n̄ give l <= ε <= u, wherever θ̂ lies.
TEST(Threshold, HoldsEveryResidualWithoutAFault) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Eigen::Index p = 3;
    const Polytope set = random_polytope(seed, p, seed % 2 == 0 ? 0.0 : -4.0);
    const Eigen::VectorXd estimate = 3.0 * Random(seed).matrix(p, 1);
    Random random(seed + 2000);
    for (const ParameterSetKind kind : {ParameterSetKind::box, ParameterSetKind::polytope}) {
      const ThresholdRule rule(set, estimate, kind);
      for (int k = 0; k < 300; ++k) {
        const Row row = random_row(random, 3, 0.2);
        // A vertex in a random direction, with the worst signs of all errors half of the time.
        std::vector<double> theta(3), direction(3);
        for (double& d : direction) d = random.symmetric();
        set.support(direction, theta);
        for (double& value : theta) value += 1e-9 * (1.0 - value);  // towards (1, …, 1): known to rounding only
        const double worst = random.unit() < 0.5 ? 1.0 : random.unit();
        const double side = random.unit() < 0.5 ? -1.0 : 1.0;
        double torque = side * worst * row.output * (1.0 - 1e-9), predicted = 0.0;
        for (std::size_t j = 0; j < 3; ++j) {
          const double towards = side * (theta[j] >= 0.0 ? 1.0 : -1.0);
          torque += (row.y[j] + towards * worst * row.dy[j] * (1.0 - 1e-9)) * theta[j];
          predicted += row.y[j] * estimate[static_cast<Eigen::Index>(j)];
        }
        const Threshold t = rule.at(row.y, row.dy, row.output);
        EXPECT_LE(t.lower, torque - predicted);
        EXPECT_GE(t.upper, torque - predicted);
      }
    }
  }
}

// [l, u] + yθ̂ is a set of torques: it does not depend on θ̂, and the symmetric interval contains it.
TEST(Threshold, TheTwoSidedTestDoesNotDependOnTheEstimate) {
  const Polytope set = random_polytope(3, 3, 0.0);
  Random random(9);
  for (int k = 0; k < 200; ++k) {
    const Row row = random_row(random, 3, 0.2);
    const Eigen::Vector3d first = 5.0 * random.matrix(3, 1), second = 5.0 * random.matrix(3, 1);
    const Eigen::Map<const Eigen::Vector3d> y(row.y.data());
    const Threshold a = ThresholdRule(set, first).at(row.y, row.dy, row.output);
    const Threshold b = ThresholdRule(set, second).at(row.y, row.dy, row.output);
    EXPECT_NEAR(a.lower + y.dot(first), b.lower + y.dot(second), 1e-11);
    EXPECT_NEAR(a.upper + y.dot(first), b.upper + y.dot(second), 1e-11);
    EXPECT_LE(-a.rho(), a.lower);
    EXPECT_GE(a.rho(), a.upper);
  }
}

TEST(Threshold, MisuseIsRefused) {
  Box box;
  box.sides = {{0.0, 1.0}, {0.0, 1.0}};
  EXPECT_THROW(ThresholdRule(Polytope({}, box), Eigen::Vector3d::Zero()), InvalidArgument);
  EXPECT_THROW(ThresholdRule(Polytope({}, box), Eigen::Vector2d(0.0, std::nan(""))), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::threshold_test

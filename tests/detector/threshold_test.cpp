// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>
#include <boost/multiprecision/cpp_int.hpp>

#include "core/error.hpp"
#include "core/limits.hpp"
#include "detector/threshold.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::detector::threshold_test {
namespace {

using Rational = boost::multiprecision::cpp_rational;
using testing_support::Random;

// A set by its inequalities, which every number below is held against exactly.
struct Inequalities {
  std::vector<bounds::HalfSpace> rows;
  Box box;

  [[nodiscard]] Polytope polytope() const { return Polytope(rows, box); }
  [[nodiscard]] bool contains(const std::vector<double>& theta) const {
    for (const bounds::HalfSpace& row : rows) {
      Rational left = 0;
      for (std::size_t j = 0; j < theta.size(); ++j) {
        left += Rational(row.a[static_cast<Eigen::Index>(j)]) * Rational(theta[j]);
      }
      if (left > Rational(row.b)) {
        return false;
      }
    }
    return box.contains(theta);
  }
};

// A box cut by half-spaces around the point (1, …, 1), which stays inside.
Inequalities random_set(std::uint64_t seed, Eigen::Index p, double lowest) {
  Random random(seed);
  Inequalities set;
  for (int k = 0; k < 12; ++k) {
    const Eigen::VectorXd a = random.matrix(p, 1);
    set.rows.push_back({a, a.sum() + 0.3 * random.unit(), {}});
  }
  set.box.sides.assign(static_cast<std::size_t>(p), {lowest, 4.0});
  return set;
}

Polytope random_polytope(std::uint64_t seed, Eigen::Index p, double lowest) {
  return random_set(seed, p, lowest).polytope();
}

// A member at a vertex, as near as doubles come: moved towards (1, …, 1) until it satisfies every inequality exactly.
std::vector<double> extreme_member(const Inequalities& set, const Polytope& polytope, Random& random) {
  std::vector<double> direction(set.box.dimension()), vertex(direction.size());
  for (double& d : direction) d = random.symmetric();
  polytope.support(direction, vertex);
  std::vector<double> theta = vertex;
  for (double step = 0x1p-53; !set.contains(theta); step *= 2.0) {
    for (std::size_t j = 0; j < theta.size(); ++j) theta[j] = vertex[j] + step * (1.0 - vertex[j]);
  }
  return theta;
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

// What the rule's own rounding may add on each side: of the prediction, and of h with its error.
double room(const ThresholdRule& rule, const Row& row) {
  double size = row.output;
  for (std::size_t j = 0; j < row.y.size(); ++j) {
    const Interval& side = rule.set().hull().sides[j];
    size += std::abs(row.y[j] * rule.estimate()[static_cast<Eigen::Index>(j)]) +
            4.0 * (std::abs(row.y[j]) + row.dy[j]) * core::magnitude(side);
  }
  return 16.0 * (static_cast<double>(row.y.size()) + 4.0) * core::kEpsilon * size;
}

// [lower, upper] is not cut, and is widened by rounding alone.
void expect_outward(const Threshold& t, const Rational& lower, const Rational& upper, double room) {
  EXPECT_LE(Rational(t.lower), lower);
  EXPECT_GE(Rational(t.upper), upper);
  EXPECT_GE(Rational(t.lower), lower - Rational(room));
  EXPECT_LE(Rational(t.upper), upper + Rational(room));
}

// Δ, y and n̄ are the doubles nearest to what is written; the rest is exact.
TEST(Threshold, OfABoxIsTheSignPattern) {
  // θ ∈ [1, 2] × [3, 5], θ̂ = (1.5, 4): y = (2, −1), Δ = (0.1, 0.2), n̄ = 0.5.
  Box box;
  box.sides = {{1.0, 2.0}, {3.0, 5.0}};
  const ThresholdRule rule(Polytope({}, box), Eigen::Vector2d(1.5, 4.0), ParameterSetKind::box);
  const Row row{{2.0, -1.0}, {0.1, 0.2}, 0.5};
  const Threshold t = rule.at(row.y, row.dy, row.output);
  // h(y + Δ) = 2.1·2 − 0.8·3 = 1.8; h(−y + Δ) = −1.9·1 + 1.2·5 = 4.1; yθ̂ = −1.
  const Rational first(0.1), second(0.2), half(0.5);
  expect_outward(t, -((first - 2) * 1 + (second + 1) * 5) + 1 - half, (2 + first) * 2 + (second - 1) * 3 + 1 + half,
                 room(rule, row));
  EXPECT_EQ(t.rho(), std::max(t.upper, -t.lower));
  EXPECT_EQ(t.width(), t.upper - t.lower);
  const Interval range = rule.prediction(row.y);
  expect_outward({range.lower, range.upper}, -3, 1, room(rule, row));
}

TEST(Threshold, OfParametersOfEitherSignAllowsForBoth) {
  Box box;
  box.sides = {{-2.0, 1.0}, {-3.0, -1.0}};
  const ThresholdRule rule(Polytope({}, box), Eigen::Vector2d(0.0, -2.0), ParameterSetKind::box);
  const Row row{{1.0, 1.0}, {0.25, 0.5}, 0.0};
  const Threshold t = rule.at(row.y, row.dy, row.output);
  // θ1: y θ1 ∈ [−2, 1] and Δ|θ1| <= 0.5; θ2 <= 0: (y − Δ)θ2 <= −0.5, (y + Δ)θ2 >= −4.5. yθ̂ = −2.
  expect_outward(t, Rational(-2.0 - 0.5 - 4.5 + 2.0), Rational(1.0 + 0.5 - 0.5 + 2.0), room(rule, row));
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

// Fault-free: θ in the set, |Y° − Y| <= Δ and |n| <= n̄. All of it is exact; τ is rounded to a double that is
// admissible. Both the exact residual and the one that floating point makes of τ − yθ̂ have to lie in [l, u].
void expect_residuals_held(const Inequalities& set, const Eigen::VectorXd& estimate, std::uint64_t seed, double error,
                           int rows) {
  const Polytope polytope = set.polytope();
  const std::size_t p = set.box.dimension();
  for (const ParameterSetKind kind : {ParameterSetKind::box, ParameterSetKind::polytope}) {
    const ThresholdRule rule(polytope, estimate, kind);
    Random random(seed);
    for (int k = 0; k < rows; ++k) {
      const Row row = random_row(random, p, error);
      const std::vector<double> theta = extreme_member(set, polytope, random);
      // The worst signs of all errors at their bounds half of the time.
      const double worst = random.unit() < 0.5 ? 1.0 : random.unit(), side = random.unit() < 0.5 ? -1.0 : 1.0;
      Rational middle = 0, away = Rational(worst) * Rational(row.output), exact_prediction = 0;
      double prediction = 0.0;
      for (std::size_t j = 0; j < p; ++j) {
        const double guess = estimate[static_cast<Eigen::Index>(j)];
        middle += Rational(row.y[j]) * Rational(theta[j]);
        away += Rational(worst) * Rational(row.dy[j]) * Rational(std::abs(theta[j]));
        exact_prediction += Rational(row.y[j]) * Rational(guess);
        prediction += row.y[j] * guess;
      }
      const Rational torque = middle + Rational(side) * away;
      auto measured = static_cast<double>(torque);
      while (Rational(side) * Rational(measured) > Rational(side) * torque) {
        measured = side > 0.0 ? core::round_down(measured) : core::round_up(measured);
      }
      const Threshold t = rule.at(row.y, row.dy, row.output);
      ASSERT_LE(Rational(t.lower), Rational(measured) - exact_prediction) << k;
      ASSERT_GE(Rational(t.upper), Rational(measured) - exact_prediction) << k;
      ASSERT_LE(t.lower, measured - prediction) << k;
      ASSERT_GE(t.upper, measured - prediction) << k;
    }
  }
}

TEST(Threshold, HoldsEveryResidualWithoutAFault) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Inequalities set = random_set(seed, 3, seed % 2 == 0 ? 0.0 : -4.0);
    expect_residuals_held(set, 3.0 * Random(seed).matrix(3, 1), seed + 2000, 0.2, 150);
  }
}

// The rounding of yθ̂ outweighs all other where θ̂ is far from the set.
TEST(Threshold, CoversTheRoundingOfThePrediction) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    const Inequalities set = random_set(seed, 3, seed % 2 == 0 ? 0.0 : -4.0);
    expect_residuals_held(set, 1e7 * Random(seed).matrix(3, 1), seed + 3000, seed % 3 == 0 ? 0.0 : 0.2, 60);
  }
}

// y = 0 and parameters of either sign: the threshold is the sum Σ Δ_j max|θ_j| + n̄ alone, and is reached in a corner.
TEST(Threshold, CoversTheRoundingOfErrorsAlone) {
  Random random(5);
  for (int k = 0; k < 300; ++k) {
    Box box;
    Row row{{0.0, 0.0, 0.0}, {}, random.unit()};
    Rational reach = Rational(row.output);
    for (int j = 0; j < 3; ++j) {
      const double largest = random.unit();
      box.sides.push_back({-largest, 0.5 * largest});
      row.dy.push_back(random.unit());
      reach += Rational(row.dy.back()) * Rational(largest);
    }
    for (const ParameterSetKind kind : {ParameterSetKind::box, ParameterSetKind::polytope}) {
      const ThresholdRule rule(Polytope({}, box), Eigen::Vector3d::Zero(), kind);
      const Threshold t = rule.at(row.y, row.dy, row.output);
      ASSERT_LE(Rational(t.lower), -reach) << k;
      ASSERT_GE(Rational(t.upper), reach) << k;
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
    const ThresholdRule of_first(set, first), of_second(set, second);
    const Threshold a = of_first.at(row.y, row.dy, row.output), b = of_second.at(row.y, row.dy, row.output);
    Rational moved = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      const auto at = static_cast<Eigen::Index>(j);
      moved += Rational(row.y[j]) * (Rational(first[at]) - Rational(second[at]));
    }
    // By rounding alone, which is room() for each of them.
    const Rational allowed = Rational(room(of_first, row)) + Rational(room(of_second, row));
    EXPECT_LE(abs(Rational(a.lower) + moved - Rational(b.lower)), allowed);
    EXPECT_LE(abs(Rational(a.upper) + moved - Rational(b.upper)), allowed);
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
}  // namespace wheelwright::detector::threshold_test

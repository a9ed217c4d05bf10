// SPDX-License-Identifier: Apache-2.0
// Smallest certain and largest hidden sizes in single rows: closed forms, and the theorem itself, tried with the worst
// θ and the worst noise.
#include <array>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/limits.hpp"
#include "detector/faults/fault_margin.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::detector::fault_margin_test {
namespace {

using testing_support::Random;

// A row in memory.
struct OwnRow {
  std::vector<double> y, g1, g2, s, dY;
  double c = 0.0, dy = 0.0;
  [[nodiscard]] FaultRow view() const { return {y, g1, g2, s, dY, c, dy}; }
};

Polytope interval(double lower, double upper) {
  Box box;
  box.sides = {{lower, upper}};
  return Polytope({}, box);
}

// A radius that changes by the share x: Yθ becomes (1 + x)² Yθ.
OwnRow radius_row(const std::vector<double>& y, double dy) {
  OwnRow row{.y = y, .g1 = y, .g2 = y, .s = std::vector<double>(y.size()), .dY = std::vector<double>(y.size())};
  for (double& g : row.g1) {
    g *= 2.0;
  }
  row.dy = dy;
  return row;
}

// Theory section 5: |δ1|_min = r |√(h_hi/h_lo) − 1| for growth, r |1 − √(h_lo/h_hi)| for shrinkage.
TEST(FaultMargin, OfOneParameterIsTheClosedForm) {
  for (const double lower : {0.8, 1.9, 2.4}) {
    const double upper = 2.5;
    for (const double y : {0.3, -7.0}) {
      FaultMargin margin(ThresholdRule(interval(lower, upper), Eigen::VectorXd::Constant(1, 2.0)));
      const OwnRow row = radius_row({y}, 0.0);
      const double growth = std::sqrt(upper / lower) - 1.0, shrinkage = 1.0 - std::sqrt(lower / upper);
      EXPECT_NEAR(margin.smallest_certain(row.view(), 2.0, 1.0).value_or(core::kInfinity), growth, 1e-8 * growth);
      EXPECT_NEAR(margin.smallest_certain(row.view(), 0.9, -1.0).value_or(core::kInfinity), shrinkage,
                  1e-8 * shrinkage);
    }
  }
}

// With exact parameters what is left is the noise: a fault is seen for certain where its part of the residual exceeds
// the largest distance of two noises, Varga's smallest detectable fault 2τ/‖G_f‖ with τ the sup of the noise's
// response.
TEST(FaultMargin, WithExactParametersIsTwiceTheNoise) {
  const Eigen::Vector2d theta(2.0, 0.7);
  Box box;
  box.sides = {{theta[0], theta[0]}, {theta[1], theta[1]}};
  const std::vector<double> y = {1.5, -0.4};
  const double response = y[0] * theta[0] + y[1] * theta[1];
  OwnRow row{.y = y, .g1 = y, .g2 = {0.0, 0.0}, .s = {0.0, 0.0}, .dY = {0.0, 0.0}};  // ζ = κ Yθ
  for (const double noise : {0.0, 0.01, 0.3}) {
    row.dy = noise;
    FaultMargin margin(ThresholdRule(Polytope({}, box), theta));
    for (const double side : {1.0, -1.0}) {
      const double smallest = margin.smallest_certain(row.view(), 1.0, side).value_or(core::kInfinity);
      EXPECT_NEAR(smallest, 2.0 * noise / response, 1e-8 * noise + 1e-13) << noise;
    }
  }
}

// Known errors of the regressor count on both sides.
TEST(FaultMargin, CountsTheRegressorsErrorTwice) {
  FaultMargin margin(ThresholdRule(interval(1.0, 1.0), Eigen::VectorXd::Constant(1, 1.0)));
  const OwnRow row{.y = {1.0}, .g1 = {1.0}, .g2 = {0.0}, .s = {0.0}, .dY = {0.05}, .dy = 0.1};
  EXPECT_NEAR(margin.smallest_certain(row.view(), 1.0, 1.0).value_or(core::kInfinity), 2.0 * 0.05 + 2.0 * 0.1, 1e-8);
  // Noise-free sensors show it once it is over what the threshold allows for Δ and n̄; noise at its bounds at once.
  EXPECT_NEAR(margin.largest_hidden(row.view(), 1.0, 1.0, 0.0), 0.05 + 0.1, 1e-3);
  EXPECT_NEAR(margin.largest_hidden(row.view(), 1.0, 1.0, 1.0), 0.0, 1e-8);
}

TEST(FaultMargin, OfAFaultThatDoesNothingIsNone) {
  FaultMargin margin(ThresholdRule(interval(1.0, 2.0), Eigen::VectorXd::Constant(1, 1.5)));
  const OwnRow row{.y = {1.0}, .g1 = {0.0}, .g2 = {0.0}, .s = {0.0}, .dY = {0.0}, .dy = 0.1};
  EXPECT_FALSE(margin.smallest_certain(row.view(), 1e6, 1.0));
  EXPECT_EQ(margin.largest_hidden(row.view(), 1e6, 1.0, 0.5), 1e6);
}

// A parameter of either sign: for θ = −5 the fault adds 10κ − 5κ², over the noise of 4.9 from κ = 1 − √0.02 on, though
// not at κ = 2 and though θ is at most 1.
TEST(FaultMargin, HidesNothingBehindTheSignOfAParameter) {
  FaultMargin margin(ThresholdRule(interval(-5.0, 1.0), Eigen::VectorXd::Constant(1, 0.0)));
  const OwnRow row{.y = {0.0}, .g1 = {-2.0}, .g2 = {1.0}, .s = {0.0}, .dY = {0.0}, .dy = 4.9};
  const double smallest = 1.0 - std::sqrt(0.02);
  ASSERT_TRUE(margin.possible(row.view(), 1.0001 * smallest, 1.0, 0.0));
  const double hidden = margin.largest_hidden(row.view(), 2.0, 1.0, 0.0);
  EXPECT_LE(hidden, smallest);
  EXPECT_GT(hidden, (1.0 - 2e-3) * smallest);
}

Polytope random_set(Random& random, Eigen::Index p) {
  std::vector<bounds::HalfSpace> rows;
  const Eigen::VectorXd inside = Eigen::VectorXd::Constant(p, 1.0);
  for (int k = 0; k < 10; ++k) {
    const Eigen::VectorXd a = random.matrix(p, 1);
    rows.push_back({a, a.dot(inside) + 0.2 * random.unit(), {}});
  }
  Box box;
  box.sides.assign(static_cast<std::size_t>(p), {0.2, 3.0});
  return Polytope(rows, box);
}

// Kinds of signatures that faults have: linear, quadratic, in what is seen, additive.
OwnRow random_fault(Random& random, std::size_t p, std::size_t kind) {
  OwnRow row;
  for (std::size_t j = 0; j < p; ++j) {
    row.y.push_back(2.0 * random.symmetric());
    row.g1.push_back(kind == 3 ? 0.0 : random.symmetric());
    row.g2.push_back(kind == 1 ? 0.5 * random.symmetric() : 0.0);
    row.s.push_back(kind == 2 ? random.symmetric() : 0.0);
    row.dY.push_back(0.02 * random.unit());
  }
  if (kind == 2) {
    row.g1.assign(p, 0.0);
  }
  row.c = kind == 3 ? random.symmetric() : 0.0;
  row.dy = 0.05 * random.unit();
  return row;
}

struct Extreme {
  Eigen::VectorXd theta;
  double noise;              // of τ_f, −1, 0 or 1
  std::vector<double> sign;  // of δ, per entry
};

// Whether the detector is silent for this θ and noise.
bool silent(const ThresholdRule& rule, const OwnRow& row, double kappa, double side, const Extreme& e) {
  double torque = side * kappa * row.c + e.noise * row.dy, predicted = 0.0;
  std::vector<double> seen(row.y.size());
  for (std::size_t j = 0; j < seen.size(); ++j) {
    const auto k = static_cast<Eigen::Index>(j);
    torque += (row.y[j] + side * kappa * row.g1[j] + kappa * kappa * row.g2[j]) * e.theta[k];
    seen[j] = row.y[j] + side * kappa * row.s[j] + e.sign[j] * row.dY[j];
    predicted += seen[j] * rule.estimate()[k];
  }
  const Threshold t = rule.at(seen, row.dY, row.dy);
  const double residual = torque - predicted;
  return residual >= t.lower && residual <= t.upper;
}

// Members of the set: maximisers of random directions and of the ones that matter, and mixtures of them.
std::vector<Eigen::VectorXd> members(const Polytope& set, Random& random, const std::vector<Eigen::VectorXd>& also) {
  std::vector<Eigen::VectorXd> list;
  const auto p = static_cast<Eigen::Index>(set.dimension());
  for (int k = 0; k < 12; ++k) {
    Eigen::VectorXd direction =
        k < static_cast<int>(also.size()) ? also[static_cast<std::size_t>(k)] : Eigen::VectorXd(random.matrix(p, 1));
    Eigen::VectorXd theta(p);
    set.support({direction.data(), set.dimension()}, {theta.data(), set.dimension()});
    list.push_back(theta);
  }
  for (int k = 0; k < 6; ++k) {
    const double share = random.unit();
    list.push_back(share * list[random.below(12)] + (1.0 - share) * list[random.below(12)]);
  }
  return list;
}

// The theorem: no θ of the set, no noise and no size above the smallest certain one keeps the detector silent. And it
// is tight: a little below there are θ and noise that do.
TEST(FaultMargin, IsATheoremAndTight) {
  Random random(20261121);
  std::size_t found = 0, tight = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const Eigen::Index p = 2 + trial % 4;
    const Polytope set = random_set(random, p);
    const ThresholdRule rule(set, Eigen::VectorXd::Constant(p, 1.1));
    FaultMargin margin(rule);
    const OwnRow row = random_fault(random, static_cast<std::size_t>(p), random.below(4));
    const double side = random.unit() < 0.5 ? 1.0 : -1.0, largest = 4.0;
    const auto smallest = margin.smallest_certain(row.view(), largest, side);
    if (!smallest) {
      continue;
    }
    ++found;
    bool hides = false;
    for (const double factor : {0.9999, 1.0, 1.001, 1.3, 2.0, largest / *smallest}) {
      const double kappa = factor * *smallest;
      if (kappa > largest) {
        continue;
      }
      Eigen::VectorXd acting(p), seen(p);
      for (Eigen::Index j = 0; j < p; ++j) {
        const auto k = static_cast<std::size_t>(j);
        acting[j] = row.y[k] + side * kappa * row.g1[k] + kappa * kappa * row.g2[k];
        seen[j] = row.y[k] + side * kappa * row.s[k];
      }
      for (const Eigen::VectorXd& theta : members(set, random, {acting, -acting, seen, -seen})) {
        for (const double noise : {-1.0, 0.0, 1.0}) {
          for (const double sign : {-1.0, 1.0, 0.0}) {
            Extreme e{theta, noise, std::vector<double>(static_cast<std::size_t>(p), sign)};
            if (sign == 0.0) {
              for (double& each : e.sign) {
                each = random.symmetric();
              }
            }
            const bool quiet = silent(rule, row, kappa, side, e);
            if (factor >= 1.0) {
              ASSERT_FALSE(quiet) << "trial " << trial << ", factor " << factor;
            } else {
              hides = hides || quiet;
            }
          }
        }
      }
    }
    tight += hides ? 1 : 0;
  }
  EXPECT_GT(found, 100u);
  EXPECT_EQ(tight, found);
}

// The mirror image: below the hidden size no θ and no noise of that share shows the fault; a little above some do,
// where it is not hidden altogether.
TEST(FaultMargin, HiddenSizesAreHiddenAndTight) {
  Random random(77);
  std::size_t found = 0, shown = 0;
  for (int trial = 0; trial < 400; ++trial) {
    const Eigen::Index p = 2 + trial % 4;
    const Polytope set = random_set(random, p);
    const ThresholdRule rule(set, Eigen::VectorXd::Constant(p, 0.9));
    FaultMargin margin(rule);
    const OwnRow row = random_fault(random, static_cast<std::size_t>(p), random.below(4));
    const double side = random.unit() < 0.5 ? 1.0 : -1.0, largest = 4.0, share = 0.5;
    const double hidden = margin.largest_hidden(row.view(), largest, side, share);
    bool appears = false;
    for (const double factor : {0.3, 1.0, 1.01}) {
      const double kappa = factor * hidden + (factor > 1.0 ? 1e-6 : 0.0);
      Eigen::VectorXd acting(p);
      for (Eigen::Index j = 0; j < p; ++j) {
        const auto k = static_cast<std::size_t>(j);
        acting[j] = row.y[k] + side * kappa * row.g1[k] + kappa * kappa * row.g2[k];
      }
      for (const Eigen::VectorXd& theta : members(set, random, {acting, -acting})) {
        for (const double noise : {-share, share}) {
          for (const double sign : {-share, share}) {
            const bool quiet =
                silent(rule, row, kappa, side, {theta, noise, std::vector<double>(static_cast<std::size_t>(p), sign)});
            if (factor <= 1.0) {
              ASSERT_TRUE(quiet) << "trial " << trial << ", factor " << factor;
            } else {
              appears = appears || !quiet;
            }
          }
        }
      }
    }
    if (hidden < largest) {
      ++found;
      shown += appears ? 1 : 0;
    }
  }
  EXPECT_GT(found, 100u);
  EXPECT_GE(shown, found - found / 50);
}

}  // namespace
}  // namespace wheelwright::detector::fault_margin_test

// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/filter/effort_correction.hpp"

namespace wheelwright::filter::effort_correction_test {
namespace {

constexpr double kStep = 0.01;

EffortCorrector corrector(const EffortCorrection& correction, Hold hold) { return {correction, 1, hold, kStep}; }

// A unit step of a held effort at 0: y = 1 − e^{−t/T}, its mean over [t, t + h] = 1 − T/h (e^{−t/T} − e^{−(t+h)/T}).
TEST(EffortCorrection, TheLagOfAStepIsTheExponential) {
  constexpr double lag = 0.03;
  EffortCorrector c = corrector({.gain = {}, .lag = lag}, Hold::zero_order);
  const double nothing = 0.0, unit = 1.0;
  c.step(-kStep, &nothing);
  c.step(0.0, &unit);
  for (int k = 1; k < 20; ++k) {
    const double t = k * kStep;
    c.step(t, &unit);
    EXPECT_NEAR(c.now(0), 1.0 - std::exp(-t / lag), 1e-13);
    EXPECT_NEAR(c.mean(0), 1.0 - lag / kStep * (std::exp(-(t - kStep) / lag) - std::exp(-t / lag)), 1e-13);
  }
}

// The effort t, logged linear between samples: y = t − T + T e^{−t/T}.
TEST(EffortCorrection, TheLagOfARampIsExact) {
  constexpr double lag = 0.03;
  EffortCorrector c = corrector({.gain = {}, .lag = lag}, Hold::first_order);
  double t = 0.0;
  for (int k = 0; k < 30; ++k) {
    c.step(t, &t);
    EXPECT_NEAR(c.now(0), t - lag * -std::expm1(-t / lag), 1e-14);
    t += k % 3 == 0 ? 0.4 * kStep : 1.3 * kStep;  // uneven steps
  }
}

// A delay of 2.3 steps: of an effort that is linear between samples the value then, of one that is held the mean over
// the shifted interval.
TEST(EffortCorrection, ADelayShifts) {
  constexpr double delay = 2.3 * kStep;
  EffortCorrector linear = corrector({.gain = {}, .delay = delay}, Hold::first_order);
  EffortCorrector held = corrector({.gain = {}, .delay = delay}, Hold::zero_order);
  const auto u = [](int k) { return std::sin(0.7 * k) + 0.1 * k; };
  for (int k = 0; k < 40; ++k) {
    const double now = u(k);
    linear.step(k * kStep, &now);
    held.step(k * kStep, &now);
    if (k >= 4) {
      EXPECT_NEAR(linear.now(0), 0.7 * u(k - 2) + 0.3 * u(k - 3), 1e-12);
      EXPECT_NEAR(held.mean(0), 0.7 * u(k - 3) + 0.3 * u(k - 4), 1e-12);
    }
  }
}

TEST(EffortCorrection, SaturationDeadZoneAndGainActInThisOrder) {
  EffortCorrector c({.limit = 2.0, .deadzone = 0.5, .gain = {1.1, 0.9}}, 2, Hold::first_order, kStep);
  const std::vector<double> effort = {3.0, -0.4};
  c.step(0.0, effort.data());
  EXPECT_DOUBLE_EQ(c.now(0), 1.1 * 1.5);
  EXPECT_EQ(c.now(1), 0.0);
  const std::vector<double> other = {-1.0, 0.75};
  c.step(kStep, other.data());
  EXPECT_DOUBLE_EQ(c.now(0), -1.1 * 0.5);
  EXPECT_DOUBLE_EQ(c.now(1), 0.9 * 0.25);
}

// What the filter of the speeds makes of efforts for any time within its interval is within the doubt of what it makes
// of them for the middle: the sums written out.
TEST(EffortCorrection, TheDoubtHoldsEveryTimeConstant) {
  using model::SpeedFilterKind;
  const auto filtered = [](const std::vector<double>& u, SpeedFilterKind kind, int order, double time) {
    std::vector<double> y(u.size());
    const auto at = [&](std::size_t k, std::size_t age) { return u[k >= age ? k - age : 0]; };
    for (std::size_t k = 0; k < u.size(); ++k) {
      double sum = 0.0, weights = 0.0;
      for (std::size_t age = 0; age < 400; ++age) {
        const double n = time / kStep, p = std::exp(-1.0 / n), i = static_cast<double>(age);
        const double weight = kind == SpeedFilterKind::mean ? std::clamp(n - i, 0.0, 1.0)
                              : order == 1                  ? std::pow(p, i)
                                                            : (i + 1.0) * std::pow(p, i);
        sum += weight * at(k, age);
        weights += weight;
      }
      y[k] = sum / weights;
    }
    return y;
  };
  std::vector<double> u(300);
  for (std::size_t k = 0; k < u.size(); ++k) {
    const auto t = static_cast<double>(k);
    u[k] = std::sin(0.05 * t) + 0.3 * std::cos(1.7 * t * t) + (k > 150 ? 1.0 : 0.0);
  }
  for (const auto& [kind, order] : {std::pair{SpeedFilterKind::exponential, 1},
                                    std::pair{SpeedFilterKind::exponential, 2}, std::pair{SpeedFilterKind::mean, 1}}) {
    for (const Interval time : {Interval{0.05, 0.05}, Interval{0.04, 0.06}, Interval{0.015, 0.1}}) {
      const model::SpeedFilter filter{.kind = kind, .order = order, .time = time};
      EffortCorrector held = corrector({.gain = {}, .smoothing = filter}, Hold::zero_order);
      EffortCorrector linear = corrector({.gain = {}, .smoothing = filter}, Hold::first_order);
      std::vector<std::vector<double>> others;
      for (int i = 0; i <= 8; ++i) {
        others.push_back(filtered(u, kind, order, time.lower + 0.125 * i * (time.upper - time.lower)));
      }
      double largest = 0.0;
      for (std::size_t k = 0; k < u.size(); ++k) {
        held.step(kStep * static_cast<double>(k), &u[k]);
        linear.step(kStep * static_cast<double>(k), &u[k]);
        const std::size_t before = k > 0 ? k - 1 : 0;  // what is held in the step that ends here
        EXPECT_NEAR(linear.now(0), others[4][k], 1e-9);
        EXPECT_NEAR(held.mean(0), others[4][before], 1e-9);
        for (const std::vector<double>& other : others) {
          EXPECT_LE(std::abs(other[k] - linear.now(0)), linear.doubt(0) + 1e-9) << k;
          EXPECT_LE(std::abs(other[before] - held.mean(0)), held.doubt(0) + 1e-9) << k;
        }
        largest = std::max(largest, held.doubt(0));
      }
      EXPECT_EQ(largest > 0.0, time.upper > time.lower);
    }
  }
}

// A lag integrated in small steps, for the ends of its interval.
TEST(EffortCorrection, TheDoubtOfALagHoldsItsEnds) {
  const model::SpeedFilter filter{.kind = model::SpeedFilterKind::lag, .time = {0.03, 0.05}};
  for (const Hold hold : {Hold::zero_order, Hold::first_order}) {
    EffortCorrector c = corrector({.gain = {}, .smoothing = filter}, hold);
    double low = 0.0, high = 0.0, before = 0.0;
    for (int k = 0; k < 200; ++k) {
      const double u = std::sin(0.3 * k) + (k % 7 == 0 ? 1.0 : 0.0);
      c.step(kStep * k, &u);
      if (k == 0) {
        low = high = u;
      } else {
        double apart = 0.0;
        constexpr int kFine = 1000;
        double sum_low = 0.0, sum_high = 0.0;
        for (int i = 0; i < kFine; ++i) {
          const double in = hold == Hold::zero_order ? before : before + (u - before) * (i + 0.5) / kFine;
          low += (in - low) * -std::expm1(-kStep / kFine / 0.03);
          high += (in - high) * -std::expm1(-kStep / kFine / 0.05);
          sum_low += low / kFine;
          sum_high += high / kFine;
        }
        apart = std::max({std::abs(low - c.now(0)), std::abs(high - c.now(0)), std::abs(sum_low - c.mean(0)),
                          std::abs(sum_high - c.mean(0))});
        EXPECT_LE(apart, c.doubt(0) + 2e-4) << k;
        EXPECT_TRUE(k == 1 || c.doubt(0) > 0.0) << k;
      }
      before = u;
    }
  }
}

// The same samples after a restart give the same bits, however long the corrector ran before.
TEST(EffortCorrection, ARestartForgets) {
  const EffortCorrection both{.gain = {}, .delay = 0.034, .lag = 0.02};
  EffortCorrector fresh = corrector(both, Hold::first_order), used = corrector(both, Hold::first_order);
  for (int k = 0; k < 57; ++k) {
    const double u = std::cos(0.3 * k);
    used.step(k * kStep, &u);
  }
  used.restart();
  for (int k = 0; k < 57; ++k) {
    const double u = std::sin(0.2 * k);
    fresh.step(100.0 + k * kStep, &u);
    used.step(100.0 + k * kStep, &u);
    EXPECT_EQ(fresh.now(0), used.now(0));
    EXPECT_EQ(fresh.mean(0), used.mean(0));
  }
}

TEST(EffortCorrection, WhatMakesNoSenseIsRefused) {
  EXPECT_THROW(corrector({.gain = {}, .delay = -0.1}, Hold::first_order), InvalidArgument);
  EXPECT_THROW(corrector({.gain = {1.0, 1.0}}, Hold::first_order), InvalidArgument);
  EXPECT_THROW(EffortCorrector({.gain = {}, .delay = 0.1}, 1, Hold::first_order, 0.0), InvalidArgument);
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  robot.effects = {{"sensor_time_offset", {{"dt", {-0.01, -0.01}}}}};
  EXPECT_THROW(static_cast<void>(effort_correction(robot, true)), InvalidArgument);
}

TEST(EffortCorrection, ARobotWithoutSuchEffectsHasNone) {
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  EXPECT_TRUE(effort_correction(robot, true).empty());
  robot.effects = {{"coulomb", {{"c", {0.1, 0.1}}}}};
  EXPECT_TRUE(effort_correction(robot, true).empty());
  robot.effects = {{"delay", {{"T_d", {0.02, 0.02}}}}, {"sensor_time_offset", {{"dt", {0.01, 0.01}}}}};
  EXPECT_DOUBLE_EQ(effort_correction(robot, true).delay, 0.03);
}

}  // namespace
}  // namespace wheelwright::filter::effort_correction_test

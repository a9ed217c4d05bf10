// SPDX-License-Identifier: Apache-2.0
#include <cmath>
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
  EXPECT_THROW(static_cast<void>(effort_correction(robot)), InvalidArgument);
}

TEST(EffortCorrection, ARobotWithoutSuchEffectsHasNone) {
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  EXPECT_TRUE(effort_correction(robot).empty());
  robot.effects = {{"coulomb", {{"c", {0.1, 0.1}}}}};
  EXPECT_TRUE(effort_correction(robot).empty());
  robot.effects = {{"delay", {{"T_d", {0.02, 0.02}}}}, {"sensor_time_offset", {{"dt", {0.01, 0.01}}}}};
  EXPECT_DOUBLE_EQ(effort_correction(robot).delay, 0.03);
}

}  // namespace
}  // namespace wheelwright::filter::effort_correction_test

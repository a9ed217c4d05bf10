// SPDX-License-Identifier: Apache-2.0
// What the clocks of a log are, found over rates, kinds of scatter, losses and encoders; logs are made here, of sines.
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "commission/doctor/log_health.hpp"

namespace wheelwright::doctor::clocks_test {
namespace {

constexpr double kSeconds = 60.0;

Robot a_robot() {
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  return robot;
}

// Right and left wheel at time t: turned angle (order 0), speed (order 1).
double wheel(double t, double side, int order) {
  double value = 0.0;
  for (const auto& [size, rate, phase] : {std::array{4.0, 0.9, 0.3}, {2.5, 2.3, 1.1}, {side * 3.0, 1.6, 0.7}}) {
    value += order == 0 ? -size / rate * std::cos(rate * t + phase) : size * std::sin(rate * t + phase);
  }
  return value;
}

struct Case {
  double step = 0.01;
  double lost = 0.0;
  std::optional<int> counts = 4096;  // a turn; nothing: exact angles
  bool speeds = false;               // in place of angles
  double speed_noise = 0.001;        // rad/s, uniform
  bool really_uneven = false;        // samples are where their stamps say
  std::size_t seed = 1;
};

// `late(k)`: of a step.
LogTable a_log(const Case& c, const std::function<double(std::size_t, std::mt19937_64&)>& late) {
  std::mt19937_64 rng(c.seed);
  std::uniform_real_distribution<double> chance(0.0, 1.0), noise(-0.01, 0.01);
  LogTable log;
  log.names = c.speeds ? std::vector<std::string>{"omega_r", "omega_l", "tau_r", "tau_l"}
                       : std::vector<std::string>{"phi_r", "phi_l", "tau_r", "tau_l"};
  log.columns.resize(4);
  double before = -1.0;
  for (std::size_t k = 0; static_cast<double>(k) * c.step < kSeconds; ++k) {
    const double even = static_cast<double>(k) * c.step;
    before = std::max(before + 1e-3 * c.step, even + late(k, rng) * c.step);
    if (k > 0 && chance(rng) < c.lost) {
      continue;
    }
    const double taken = c.really_uneven ? before : even;
    log.t.push_back(before);
    for (std::size_t side = 0; side < 2; ++side) {
      double value = wheel(taken, side == 0 ? 1.0 : -1.0, c.speeds ? 1 : 0);
      if (c.speeds) {
        value += c.speed_noise / 0.01 * noise(rng);
      } else if (c.counts) {
        const double count = 2.0 * std::numbers::pi / *c.counts;
        value = std::floor(value / count) * count;
      }
      log.columns[side].push_back(value);
      log.columns[2 + side].push_back(wheel(taken, side == 0 ? 1.0 : -1.0, 1) + noise(rng));
    }
  }
  return log;
}

using Late = std::function<double(std::size_t, std::mt19937_64&)>;

// Scatter of a standard deviation of `size` steps: normal, uniform, with an exponential tail.
std::vector<Late> scatters(double size) {
  return {[size](std::size_t, std::mt19937_64& rng) { return std::normal_distribution<double>(0.0, size)(rng); },
          [size](std::size_t, std::mt19937_64& rng) {
            return std::uniform_real_distribution<double>(0.0, size * std::sqrt(12.0))(rng);
          },
          [size](std::size_t, std::mt19937_64& rng) { return std::exponential_distribution<double>(1.0 / size)(rng); }};
}

std::optional<EvenClock> clock_of(const LogTable& log, std::vector<LogFinding>& findings) {
  return check_clock(make_view(log, a_robot()), findings);
}

std::string words(const Case& c, double size, std::size_t kind, const std::vector<LogFinding>& findings) {
  return "step " + std::to_string(c.step) + ", lost " + std::to_string(c.lost) + ", counts " +
         std::to_string(c.counts.value_or(0)) + ", scatter " + std::to_string(size) + ", kind " + std::to_string(kind) +
         (findings.empty() ? "" : ": " + findings.front().sentence);
}

TEST(Clocks, EvenSamplesBehindScatteredStampsAreRecognised) {
  for (const double step : {0.05, 0.02, 0.01, 0.005, 0.002}) {
    for (const double size : {0.01, 0.02, 0.05, 0.1}) {
      for (const double lost : {0.0, 0.01}) {
        for (std::size_t kind = 0; kind < 3; ++kind) {
          // An encoder whose count is less than what the scatter moves an angle by tells the one from the other.
          const Case c{.step = step, .lost = lost, .counts = 32768, .seed = 1 + kind};
          std::vector<LogFinding> findings;
          const auto clock = clock_of(a_log(c, scatters(size)[kind]), findings);
          ASSERT_TRUE(clock) << words(c, size, kind, findings);
          EXPECT_LE(std::abs(step / clock->step - 1.0), clock->drift) << words(c, size, kind, findings);
          EXPECT_LE(clock->drift, 2e-3 * size + 1e-6) << words(c, size, kind, findings);
        }
      }
    }
  }
}

// Where the motion shows the scatter badly, chance may make it look as if samples moved against their stamps.
TEST(Clocks, StampsThatScatterMuchAreNeverTakenForTrueInSilence) {
  std::size_t read = 0, untold = 0;
  for (const double noise : {0.03, 0.1, 0.3}) {
    for (std::size_t seed = 1; seed <= 100; ++seed) {
      const Case c{.step = 0.1, .speeds = true, .speed_noise = noise, .seed = seed};
      std::vector<LogFinding> findings;
      const bool clock = clock_of(a_log(c, scatters(0.075)[0]), findings).has_value();
      EXPECT_TRUE(clock || !findings.empty()) << noise << ", seed " << seed;
      read += clock ? 1 : 0;
      untold += clock ? 0 : 1;
      std::vector<LogFinding> true_ones;
      EXPECT_FALSE(
          clock_of(a_log({.step = 0.1, .speeds = true, .speed_noise = noise, .really_uneven = true, .seed = seed},
                         scatters(0.075)[0]),
                   true_ones))
          << noise << ", seed " << seed;
    }
  }
  EXPECT_GT(read, 100U);
  EXPECT_LT(untold, 150U);
}

TEST(Clocks, SamplesThatAreWhereTheirStampsSayStayThere) {
  for (const double step : {0.05, 0.01, 0.002}) {
    for (const double size : {0.001, 0.01, 0.1}) {
      for (std::size_t kind = 0; kind < 3; ++kind) {
        for (const int counts : {64, 4096, 32768}) {
          const Case c{.step = step, .counts = counts, .really_uneven = true, .seed = 11 + kind};
          std::vector<LogFinding> findings;
          EXPECT_FALSE(clock_of(a_log(c, scatters(size)[kind]), findings)) << words(c, size, kind, findings);
        }
      }
    }
  }
}

TEST(Clocks, EvenStampsAndStepsThatAddUpAreLeftAlone) {
  std::vector<LogFinding> findings;
  EXPECT_FALSE(clock_of(a_log({}, [](std::size_t, std::mt19937_64&) { return 0.0; }), findings));
  double walked = 0.0;
  EXPECT_FALSE(clock_of(a_log({.really_uneven = true},
                              [&](std::size_t, std::mt19937_64& rng) {
                                return walked += std::uniform_real_distribution<double>(-0.1, 0.1)(rng);
                              }),
                        findings));
  EXPECT_TRUE(findings.empty());
}

TEST(Clocks, WhatARobotFileSaysOfTheClockStands) {
  Robot robot = a_robot();
  robot.clock = EvenClock{};
  const LogTable log = a_log({}, scatters(0.05)[0]);
  std::vector<LogFinding> findings;
  EXPECT_FALSE(check_clock(make_view(log, robot), findings));
  EXPECT_TRUE(findings.empty());
  EXPECT_TRUE(check_clock(make_view(log, a_robot()), findings));
}

TEST(Clocks, RowsThatComeInBurstsAreReadEvenlyWhereTheMotionShowsThatTheyAre) {
  for (const std::size_t burst : {2, 3, 5}) {
    for (const double step : {0.1, 0.02, 0.0025}) {
      for (const bool uneven : {false, true}) {
        std::vector<LogFinding> findings;
        const LogTable log =
            a_log({.step = step, .counts = 32768, .really_uneven = uneven},
                  [&](std::size_t k, std::mt19937_64&) { return static_cast<double>(burst - 1 - k % burst); });
        const auto clock = clock_of(log, findings);
        ASSERT_EQ(clock.has_value(), !uneven) << burst << ", " << step;
        if (clock) {
          EXPECT_LE(std::abs(step / clock->step - 1.0), clock->drift);
          EXPECT_EQ(findings.front().id, "time.even_clock");
        }
      }
    }
  }
}

TEST(Clocks, RowsThatComeInBurstsAreRefusedWhereSomeAreLost) {
  for (const std::size_t burst : {2, 3, 5}) {
    std::vector<LogFinding> findings;
    const LogTable log = a_log(
        {.lost = 0.02}, [&](std::size_t k, std::mt19937_64&) { return static_cast<double>(burst - 1 - k % burst); });
    EXPECT_FALSE(clock_of(log, findings)) << burst;
    ASSERT_EQ(findings.size(), 1U) << burst;
    EXPECT_EQ(findings.front().id, "time.bursts");
    EXPECT_TRUE(findings.front().is_refusal());
    EXPECT_FALSE(findings.front().next.empty());
  }
}

// A gyro that is `lag` late, whose clock drifts by `drift` s over the log.
LogTable with_gyro(LogTable log, double lag, double drift, double noise_size) {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> noise(-noise_size, noise_size);
  log.names.emplace_back("gyro_z");
  std::vector<double>& gyro = log.columns.emplace_back();
  for (const double t : log.t) {
    const double then = t - lag - drift * (t / kSeconds - 0.5);
    gyro.push_back(0.25 * (wheel(then, 1.0, 1) - wheel(then, -1.0, 1)) + 0.01 + noise(rng));
  }
  return log;
}

TEST(Clocks, TheLagOfAGyroIsMeasured) {
  for (const double step : {0.02, 0.01, 0.002}) {
    for (const bool speeds : {true, false}) {
      for (const double lag : {0.0, -0.04, 0.03, 0.08, 0.15}) {
        const LogTable log = with_gyro(a_log({.step = step, .speeds = speeds}, scatters(1e-9)[0]), lag, 0.0, 0.003);
        std::vector<LogFinding> findings;
        check_gyro_delay(make_view(log, a_robot()), findings);
        const std::string which = std::to_string(step) + " s, lag " + std::to_string(lag);
        if (lag == 0.0) {
          EXPECT_TRUE(findings.empty()) << which << findings.front().sentence;
          continue;
        }
        ASSERT_EQ(findings.size(), 1U) << which;
        EXPECT_EQ(findings.front().id, "time.gyro_delay");
        EXPECT_NEAR(findings.front().value, lag, 0.002) << which;
      }
    }
  }
}

TEST(Clocks, AGyroWhoseClockDriftsIsTold) {
  const LogTable log = with_gyro(a_log({.speeds = true}, scatters(1e-9)[0]), 0.0, 0.06, 0.003);
  std::vector<LogFinding> findings;
  check_gyro_delay(make_view(log, a_robot()), findings);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_EQ(findings.front().id, "time.gyro_drift");
  EXPECT_NEAR(findings.front().value, 0.04, 0.005);
}

}  // namespace
}  // namespace wheelwright::doctor::clocks_test

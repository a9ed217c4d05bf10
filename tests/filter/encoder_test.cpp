// SPDX-License-Identifier: Apache-2.0
#include "model/filter/encoder.hpp"
#include "model/filter/measurement.hpp"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/random.hpp"

namespace wheelwright::filter::encoder_test {
namespace {

double printed(double x, int decimals) {
  const double unit = std::pow(10.0, decimals);
  return std::round(x * unit) / unit;
}

std::vector<double> differenced(double counts_per_turn, double step, double top_speed, int decimals) {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> phase(0.0, 6.0);
  const double offset = phase(rng);
  std::vector<double> speeds;
  double before = 0.0;
  for (int k = 0; k < 4000; ++k) {
    const double t = k * step;
    const double angle = top_speed * (std::sin(0.7 * t + offset) + 0.3 * std::sin(2.3 * t));
    const double count = std::floor(angle * counts_per_turn / (2.0 * std::numbers::pi));
    if (k > 0) {
      speeds.push_back(printed((count - before) * 2.0 * std::numbers::pi / counts_per_turn / step, decimals));
    }
    before = count;
  }
  return speeds;
}

TEST(FindEncoder, FindsTheResolutionOfDifferencedCounts) {
  for (const double counts : {512.0, 4096.0, 5000.0, 16384.0, 65536.0}) {
    for (const double step : {0.002, 0.008, 0.01}) {
      const auto found = find_encoder(differenced(counts, step, 8.0, 6), step);
      ASSERT_TRUE(found) << counts << " counts at " << step << " s";
      EXPECT_EQ(found->counts_per_turn, counts);
      EXPECT_LT(found->rounding, 0.05);
    }
  }
}

// 20 to 32768 counts at 10 to 500 Hz, by a clock that is off against the driver's: whole counts, as they are sold.
TEST(FindEncoder, FindsWholeCountsByAClockThatIsOff) {
  for (const double counts : {20.0, 100.0, 360.0, 500.0, 1000.0, 2048.0, 4096.0, 8192.0, 10000.0, 16384.0, 32768.0}) {
    for (const double rate : {10.0, 20.0, 50.0, 100.0, 200.0, 500.0}) {
      const double rpm = 60.0 * rate / counts, quantum = 2.0 * std::numbers::pi * rate / counts;
      const auto plain = [](double x) {  // 1, 2 or 5 · 10ᵏ: not told from a rounded speed
        const double scaled = x / std::pow(10.0, std::floor(std::log10(x) + 1e-9));
        return std::abs(scaled - 1.0) < 1e-3 || std::abs(scaled - 2.0) < 1e-3 || std::abs(scaled - 5.0) < 1e-3;
      };
      if (plain(rpm) || plain(quantum)) {
        continue;
      }
      for (const double off : {0.0, 5e-5, -5e-5}) {
        const auto found = find_encoder(differenced(counts, 1.0 / rate, 8.0, 6), (1.0 + off) / rate);
        ASSERT_TRUE(found) << counts << " counts at " << rate << " Hz, " << off;
        EXPECT_EQ(found->counts_per_turn, counts) << rate << " Hz, " << off;
      }
    }
  }
}

TEST(FindEncoder, SurvivesFourPrintedDecimals) {
  const auto found = find_encoder(differenced(16384.0, 0.01, 8.0, 4), 0.01);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->counts_per_turn, 16384.0);
}

TEST(FindEncoder, DecimalsAreNoEncoder) {
  std::mt19937_64 rng(1);
  std::normal_distribution<double> gauss;
  for (const int decimals : {2, 3, 4}) {
    std::vector<double> speeds;
    for (int k = 0; k < 3000; ++k) {
      speeds.push_back(printed(3.0 * std::sin(0.01 * k) + 0.1 * gauss(rng), decimals));
    }
    EXPECT_FALSE(find_encoder(speeds, 0.01)) << decimals;
  }
}

// Drives that report whole rpm (or tenths, or tens of them), printed with few or many decimals.
TEST(FindEncoder, WholeRpmAreNoEncoder) {
  const double rpm = 2.0 * std::numbers::pi / 60.0;
  for (const double unit : {0.1, 0.5, 1.0, 2.0, 5.0, 10.0}) {
    for (const int decimals : {4, 6, 12}) {
      for (const double step : {0.002, 0.01, 0.05}) {
        std::vector<double> speeds;
        for (int k = 0; k < 4000; ++k) {
          const double speed = 12.0 * std::sin(0.007 * k) + 5.0 * std::sin(0.0231 * k);
          speeds.push_back(printed(std::round(speed / (unit * rpm)) * unit * rpm, decimals));
        }
        EXPECT_FALSE(find_encoder(speeds, step)) << unit << " rpm, " << decimals << " decimals, " << step << " s";
      }
    }
  }
}

TEST(FindEncoder, AnglesMayHaveAnyNumberOfCounts) {
  for (const double counts : {600.0, 1200.0, 6000.0}) {
    std::vector<double> steps = differenced(counts, 0.01, 8.0, 9);
    for (double& step : steps) {
      step *= 0.01;
    }
    const auto found = find_encoder_of_angles(steps);
    ASSERT_TRUE(found) << counts;
    EXPECT_EQ(found->counts_per_turn, counts);
  }
}

// What is merely found replaces nothing that is declared, unless that cannot be: a rounded speed is wrong by half a
// unit.
TEST(FindEncoder, AQuantumThatIsFoundReplacesNoDeclaredBound) {
  LogTable log;
  log.names = {"omega_r", "omega_l", "tau_r", "tau_l"};
  const auto speeds = differenced(4096.0, 0.01, 8.0, 9);
  log.columns.assign(4, speeds);
  for (std::size_t k = 0; k < speeds.size(); ++k) {
    log.t.push_back(0.01 * static_cast<double>(k));
  }
  TableSource source(log);
  Robot robot;
  robot.wheel_radius = 0.1;
  robot.track_width = 0.4;
  const double count = 2.0 * std::numbers::pi / (4096.0 * 0.01);
  const auto found = [&] { return find_measurement(source, robot, model::make_model(robot), 2); };
  EXPECT_EQ(found().motion, MotionKind::mean_speed);
  robot.noise.wheel_speed.value = 0.5 * count;
  EXPECT_EQ(found().motion, MotionKind::speed);
  EXPECT_NEAR(found().unused_count, count, 1e-6);
  robot.noise.wheel_speed.value = 3.0 * count;
  EXPECT_EQ(found().motion, MotionKind::speed);
  robot.noise.wheel_speed.value = 0.1 * count;
  EXPECT_EQ(found().motion, MotionKind::mean_speed) << "no speed rounded to it can have so small an error";
  robot.noise.wheel_speed.value = 3.0 * count;
  robot.encoder_counts_per_turn = 4096.0;
  EXPECT_EQ(found().motion, MotionKind::mean_speed);
}

// A row that is lost leaves the counts of the others what they are.
TEST(FindEncoder, LostRowsAreNoUnevenSampling) {
  const auto motion = [](auto time_of) {
    LogTable log;
    log.names = {"omega_r", "omega_l", "tau_r", "tau_l"};
    log.columns.resize(4);
    const auto speeds = differenced(4096.0, 0.01, 8.0, 9);
    for (std::size_t k = 0; k < speeds.size(); ++k) {
      if (const double t = time_of(k); t >= 0.0) {
        log.t.push_back(t);
        for (auto& column : log.columns) {
          column.push_back(speeds[k]);
        }
      }
    }
    TableSource source(log);
    Robot robot;
    robot.wheel_radius = 0.1;
    robot.track_width = 0.4;
    robot.encoder_counts_per_turn = 4096.0;
    return find_measurement(source, robot, model::make_model(robot), 2).motion;
  };
  const auto at = [](std::size_t k) { return 0.01 * static_cast<double>(k); };
  EXPECT_EQ(motion([&](std::size_t k) { return k % 40 == 7 ? -1.0 : at(k); }), MotionKind::mean_speed);
  EXPECT_EQ(motion([&](std::size_t k) { return k % 40 == 7 || k % 90 == 8 || k % 90 == 9 ? -1.0 : at(k); }),
            MotionKind::mean_speed);
  EXPECT_EQ(motion([&](std::size_t k) { return at(k) + (k % 40 == 7 ? 0.004 : 0.0); }), MotionKind::speed);
}

TEST(FindEncoder, SmoothSpeedsAreNoEncoder) {
  std::vector<double> speeds;
  for (int k = 0; k < 3000; ++k) {
    speeds.push_back(3.0 * std::sin(0.01 * k));
  }
  EXPECT_FALSE(find_encoder(speeds, 0.01));
}

// Wheels that turn at constant speeds are near whole multiples of something, whatever these speeds are.
TEST(FindEncoder, TwoOrThreeNoisySpeedsAreNoEncoder) {
  testing_support::Random random(3);
  for (const std::vector<double>& wheels :
       {std::vector{6.1, 4.15}, std::vector{2.0, 4.0, 6.0}, std::vector{1.0, 2.0, 3.0, 4.0, 5.0}}) {
    std::vector<double> speeds;
    for (int k = 0; k < 3000; ++k) {
      speeds.push_back(wheels[static_cast<std::size_t>(k) % wheels.size()] + 0.02 * random.symmetric());
    }
    EXPECT_FALSE(find_encoder(speeds, 0.01)) << wheels.size();
  }
}

TEST(FindEncoder, KnownCountsAreChecked) {
  const auto speeds = differenced(4096.0, 0.01, 8.0, 6);
  EXPECT_TRUE(find_encoder(speeds, 0.01, 4096.0));
  EXPECT_FALSE(find_encoder(speeds, 0.01, 3000.0));
}

}  // namespace
}  // namespace wheelwright::filter::encoder_test

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/filter/encoder.hpp>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace wheelwright::encoder_test {
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

TEST(FindEncoder, SmoothSpeedsAreNoEncoder) {
  std::vector<double> speeds;
  for (int k = 0; k < 3000; ++k) {
    speeds.push_back(3.0 * std::sin(0.01 * k));
  }
  EXPECT_FALSE(find_encoder(speeds, 0.01));
}

TEST(FindEncoder, KnownCountsAreChecked) {
  const auto speeds = differenced(4096.0, 0.01, 8.0, 6);
  EXPECT_TRUE(find_encoder(speeds, 0.01, 4096.0));
  EXPECT_FALSE(find_encoder(speeds, 0.01, 3000.0));
}

}  // namespace
}  // namespace wheelwright::encoder_test

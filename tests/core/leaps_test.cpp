// SPDX-License-Identifier: Apache-2.0
// Planted leaps are found, each row of them and no other, over rates, noise, and how many they are.
#include <cmath>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/leaps.hpp"

namespace wheelwright::core::leaps_test {
namespace {

// A speed of sines between rests, or one that follows steps within `lag` s, with noise.
std::vector<double> a_speed(double rate, std::size_t rows, bool steps, std::mt19937_64& rng) {
  constexpr double lag = 0.3;
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const double fast = 0.3 + 0.2 * unit(rng), noise = 0.02 + 0.015 * unit(rng);
  std::vector<double> speed;
  double level = 0.0, followed = 0.0;
  for (std::size_t k = 0; k < rows; ++k) {
    const double t = static_cast<double>(k) / rate;
    level = std::fmod(t, 2.0) < 1.0 / rate ? 5.0 * unit(rng) : level;
    followed += (level - followed) * (1.0 - std::exp(-1.0 / (rate * lag)));
    const double rest = t < 2.0 ? 0.0 : 1.0;
    const double sines = 3.0 * std::sin(2.0 * std::numbers::pi * fast * t) + 2.0 * std::sin(1.7 * t);
    speed.push_back(rest * (steps ? followed : sines) + noise * unit(rng));
  }
  return speed;
}

TEST(Leaps, ArePlantedAndFoundAndNothingElseIs) {
  std::mt19937_64 rng(3);
  for (const double rate : {10.0, 30.0, 100.0, 500.0}) {
    for (const bool steps : {false, true}) {
      for (const std::size_t many : {0U, 1U, 3U, 12U}) {
        const auto rows = static_cast<std::size_t>(40.0 * rate);
        std::vector<double> speed = a_speed(rate, rows, steps, rng);
        std::vector<bool> planted(rows, false);
        std::uniform_int_distribution<std::size_t> place(1, (rows - 2) / 5 - 1);
        std::uniform_real_distribution<double> size(20.0, 250.0);
        for (std::size_t i = 0; i < many; ++i) {
          const std::size_t first = 5 * place(rng);  // of up to three rows, one at least between two of them
          for (std::size_t k = first; k < first + 1 + i % kLongestLeap && !planted[k]; ++k) {
            planted[k] = true;
            speed[k] = size(rng) * (rng() % 2 == 0 ? 1.0 : -1.0);
          }
        }
        const std::vector<RowRange> whole = {{0, rows}};
        EXPECT_EQ(leaps_in(speed, whole, least_leap(speed, whole, kSpeedLeap)), planted)
            << rate << " Hz, " << (steps ? "steps" : "sines") << ", " << many;
      }
    }
  }
}

TEST(Leaps, EndWhereTheSegmentDoes) {
  const std::vector<double> values = {0.0, 9.0, 0.0, 9.0};
  EXPECT_EQ(leap_behind(values, 5.0), 1U);
  EXPECT_EQ(leap_behind(values, 9.0), 0U);
  EXPECT_EQ(leap_behind(std::span(values).first(2), 5.0), 0U);
  const std::vector<RowRange> two = {{0, 2}, {2, 4}};
  EXPECT_EQ(leaps_in(values, two, 5.0), std::vector<bool>(4, false));
}

TEST(Leaps, AreNoneOfCoarseCountsAndOfWhatNeverChanges) {
  std::vector<double> counts(1000, 0.0), still(1000, 4.0);
  for (std::size_t k = 0; k < counts.size(); k += 7) {
    counts[k] = 1.0;
  }
  const std::vector<RowRange> whole = {{0, 1000}};
  for (const std::vector<double>* column : {&counts, &still}) {
    EXPECT_EQ(leaps_in(*column, whole, least_leap(*column, whole, kSpeedLeap)), std::vector<bool>(1000, false));
  }
}

}  // namespace
}  // namespace wheelwright::core::leaps_test

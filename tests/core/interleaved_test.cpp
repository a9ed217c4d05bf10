// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/interleaved.hpp"

namespace wheelwright::core::interleaved_test {
namespace {

using Columns = std::vector<std::vector<double>>;

// Angles, speeds and efforts of two wheels as an honest driver has them, which measures its steps to `measured`.
Columns honest(std::size_t rows, double rate, double counts, double noise, unsigned seed, double measured = 0.0) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Columns c(6);
  double angle[2] = {0.0, 0.0}, before[2] = {0.0, 0.0};
  for (std::size_t k = 0; k < rows; ++k) {
    const double t = static_cast<double>(k) / rate;
    for (std::size_t w = 0; w < 2; ++w) {
      const double speed = t < 2.0 ? 0.0 : 5.0 * std::sin(0.4 * t + static_cast<double>(w)) + 2.0 * std::sin(1.1 * t);
      angle[w] += speed / rate;
      const double shown = counts > 0.0 ? std::floor(angle[w] * counts / 6.28) / counts * 6.28 : angle[w];
      c[w].push_back(shown);
      c[2 + w].push_back(counts > 0.0 ? (shown - before[w]) * rate * (1.0 + measured * normal(random))
                                      : speed + noise * normal(random));
      before[w] = shown;
      c[4 + w].push_back(std::cos(0.4 * t) + noise * normal(random));
    }
  }
  return c;
}

InterleavedRows found(const Columns& c, std::size_t from = 0) {
  std::vector<const std::vector<double>*> pointers;
  for (std::size_t k = from; k < c.size(); ++k) {
    pointers.push_back(&c[k]);
  }
  return interleaved_rows(pointers);
}

TEST(InterleavedRows, AnHonestLogHasOneSource) {
  for (const double rate : {10.0, 100.0, 500.0}) {
    for (const double counts : {0.0, 20.0, 400.0, 32768.0}) {
      for (const double noise : {0.0, 0.02, 0.5}) {
        const Columns c = honest(6000, rate, counts, noise, 3);
        EXPECT_TRUE(found(c).rows.empty()) << rate << " Hz, " << counts << " counts, noise " << noise;
        EXPECT_TRUE(found(c, 2).rows.empty()) << rate << " Hz, " << counts << " counts, noise " << noise;
      }
    }
  }
}

// A driver that differences counts over the steps that it measures: no number is taken twice.
TEST(InterleavedRows, CountsOverMeasuredStepsAreOneSource) {
  for (const double rate : {10.0, 100.0, 500.0}) {
    for (const double counts : {64.0, 256.0, 1024.0, 4096.0}) {
      for (const double measured : {1e-14, 1e-5, 1e-3, 1e-2}) {
        const Columns c = honest(6000, rate, counts, 0.02, 4, measured);
        EXPECT_TRUE(found(c).rows.empty()) << rate << " Hz, " << counts << " counts, steps to " << measured;
        EXPECT_TRUE(found(c, 2).rows.empty()) << rate << " Hz, " << counts << " counts, steps to " << measured;
      }
    }
  }
}

TEST(InterleavedRows, RowsOfASecondSourceAreFound) {
  for (const double rate : {10.0, 100.0, 500.0}) {
    for (const std::size_t every : {1U, 2U, 7U, 50U}) {
      const Columns own = honest(6000, rate, 4096.0, 0.02, 5);
      for (const double constant : {0.0, 1.5}) {
        Columns c(6);
        std::size_t put = 0;
        for (std::size_t k = 0; k < own[0].size(); ++k) {
          for (std::size_t i = 0; i < 6; ++i) {
            c[i].push_back(own[i][k]);
            if (k % every == 0) {
              c[i].push_back(constant);
            }
          }
          put += k % every == 0 ? 1U : 0U;
        }
        const InterleavedRows rows = found(c);
        EXPECT_TRUE(rows.constant) << rate << " Hz, every " << every;
        EXPECT_GE(rows.rows.size(), put);
        EXPECT_LT(static_cast<double>(rows.rows.size()), static_cast<double>(put) + 2.1 * rate);
      }
    }
  }
}

TEST(InterleavedRows, SingleImpossibleRowsAreNoSource) {
  Columns c = honest(6000, 100.0, 4096.0, 0.02, 7);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anything(-1e4, 1e4);
  for (std::size_t k = 300; k < 6000; k += 150) {
    for (std::vector<double>& column : c) {
      column[k] = anything(random);
    }
  }
  EXPECT_TRUE(found(c).rows.empty());
}

}  // namespace
}  // namespace wheelwright::core::interleaved_test

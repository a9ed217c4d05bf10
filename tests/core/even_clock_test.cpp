// SPDX-License-Identifier: Apache-2.0
// Even samples behind scattered stamps: rows that are said to follow each other in time did so, to the last step.
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "core/even_clock.hpp"

namespace wheelwright::core::even_clock_test {
namespace {

struct Stamped {
  std::vector<double> number;  // of each sample that was not lost
  std::vector<double> stamp;
};

// Samples `step` apart; each is stamped late by `late(k)` steps, but never before the one before it.
Stamped stamped(std::size_t samples, double step, double lost, std::mt19937_64& rng,
                const std::function<double(std::size_t)>& late) {
  std::uniform_real_distribution<double> chance(0.0, 1.0);
  Stamped out;
  double before = -1.0;
  for (std::size_t k = 0; k < samples; ++k) {
    before = std::max(before + 1e-4 * step, (static_cast<double>(k) + late(k)) * step);
    if (k == 0 || chance(rng) >= lost) {
      out.number.push_back(static_cast<double>(k));
      out.stamp.push_back(before);
    }
  }
  return out;
}

struct Outcome {
  std::size_t wrong = 0, starts = 0, rows = 0;
};

Outcome follow(const Stamped& log, double step) {
  EvenTimes times({.step = step, .drift = 0.0});
  for (std::size_t k = 0; k < log.stamp.size(); ++k) {
    times.take(log.stamp[k], k == 0);
  }
  times.finish();
  Outcome outcome;
  double before = 0.0;
  while (const auto place = times.next()) {
    const std::size_t k = outcome.rows++;
    if (place->starts) {
      ++outcome.starts;
    } else if (std::abs((place->t - before) / step - (log.number[k] - log.number[k - 1])) > 1e-6) {
      ++outcome.wrong;
    }
    before = place->t;
  }
  return outcome;
}

// Only the last rows, behind which no burst comes, may be left without a place.
TEST(EvenTimes, RowsThatWereSentTogetherKeepTheirDistance) {
  for (const double step : {0.1, 0.0025}) {
    for (const std::size_t burst : {2U, 3U, 5U, 8U}) {
      for (const double off : {0.0, 1e-4}) {  // of the clock's step
        std::mt19937_64 rng(1);
        const Stamped log =
            stamped(1000, step, 0.0, rng, [&](std::size_t k) { return static_cast<double>(burst - 1 - k % burst); });
        EvenTimes times({.step = step * (1.0 + off), .drift = off});
        for (std::size_t k = 0; k < log.stamp.size(); ++k) {
          times.take(log.stamp[k], k == 0);
        }
        times.finish();
        double before = 0.0;
        for (std::size_t k = 0; const auto place = times.next(); ++k) {
          EXPECT_TRUE(!place->starts || k == 0 || k > log.stamp.size() - burst) << burst << ", row " << k;
          if (!place->starts) {
            EXPECT_NEAR((place->t - before) / step, 1.0, 2.0 * off + 1e-9);
          }
          before = place->t;
        }
      }
    }
  }
}

TEST(EvenTimes, RowsKeepTheirDistanceWhateverTheScatter) {
  for (const double step : {0.1, 0.02, 0.01, 0.002}) {
    for (const double size : {0.001, 0.01, 0.05, 0.1}) {  // of a step, standard deviation
      for (const double lost : {0.0, 0.01, 0.1}) {
        std::mt19937_64 rng(17);
        std::normal_distribution<double> normal(0.0, size);
        std::uniform_real_distribution<double> uniform(0.0, size * std::sqrt(12.0));
        std::exponential_distribution<double> exponential(1.0 / size);
        const std::vector<std::function<double(std::size_t)>> kinds = {
            [](std::size_t) { return 0.0; }, [&](std::size_t) { return normal(rng); },
            [&](std::size_t) { return uniform(rng); }, [&](std::size_t) { return exponential(rng); }};
        for (std::size_t kind = 0; kind < kinds.size(); ++kind) {
          const Stamped log = stamped(6000, step, lost, rng, kinds[kind]);
          const Outcome outcome = follow(log, step);
          const std::string which = "step " + std::to_string(step) + ", scatter " + std::to_string(size) + ", lost " +
                                    std::to_string(lost) + ", kind " + std::to_string(kind);
          ASSERT_EQ(outcome.rows, log.stamp.size()) << which;
          EXPECT_EQ(outcome.wrong, 0U) << which;
          EXPECT_LE(outcome.starts, size > 0.05 && lost > 0.05 ? 300U : 10U) << which;
        }
      }
    }
  }
}

TEST(EvenTimes, MessagesThatQueueAreNotTakenForLostOnes) {
  std::mt19937_64 rng(3);
  // Every 400 rows the network stands still for `stall` rows, which arrive together after it.
  for (const std::size_t stall : {2, 5, 20, 31}) {
    const Stamped log = stamped(6000, 0.01, 0.0, rng, [&](std::size_t k) {
      const std::size_t at = k % 400;
      return at >= 100 && at < 100 + stall ? static_cast<double>(100 + stall - at) : 0.02;
    });
    const Outcome outcome = follow(log, 0.01);
    EXPECT_EQ(outcome.wrong, 0U) << stall;
    EXPECT_EQ(outcome.starts, 1U) << stall;
  }
}

TEST(EvenTimes, AClockThatIsSetBeginsAnew) {
  Stamped log;
  for (std::size_t k = 0; k < 2000; ++k) {
    log.number.push_back(static_cast<double>(k));
    log.stamp.push_back(0.01 * static_cast<double>(k) + (k < 1000 ? 0.0 : 0.0345));
  }
  const Outcome outcome = follow(log, 0.01);
  EXPECT_EQ(outcome.wrong, 0U);
  EXPECT_GT(outcome.starts, 1U);
  EXPECT_LE(outcome.starts, 40U);
}

TEST(EvenTimes, AClockThatDriftsIsFollowed) {
  for (const double drift : {1e-5, 1e-4, 1e-3}) {
    Stamped log;
    for (std::size_t k = 0; k < 20000; ++k) {
      log.number.push_back(static_cast<double>(k));
      log.stamp.push_back(0.01 * (1.0 + drift) * static_cast<double>(k));
    }
    const Outcome outcome = follow(log, 0.01);
    EXPECT_EQ(outcome.wrong, 0U) << drift;
    EXPECT_EQ(outcome.starts, 1U) << drift;
  }
}

// A walk by blocks of any size, or of another walker, has the rows of the table.
TEST(EvenSource, HasTheRowsOfItsLog) {
  std::mt19937_64 rng(5);
  std::normal_distribution<double> normal(0.0, 0.08);
  const Stamped log = stamped(3000, 0.01, 0.02, rng, [&](std::size_t) { return normal(rng); });
  LogTable table;
  table.names = {"a", "b"};
  table.t = log.stamp;
  table.columns = {log.number, log.stamp};
  table.segment_starts = {0, 1700};
  const EvenClock clock{.step = 0.01, .drift = 1e-5};
  const LogTable even = read_evenly(table, clock);
  EXPECT_EQ(even.columns, table.columns);
  ASSERT_EQ(even.rows(), table.rows());
  EXPECT_TRUE(std::ranges::count(even.segment_starts, 1700U) == 1);
  for (const std::size_t rows : {1U, 7U, 4096U}) {
    EvenSource source(std::make_shared<TableSource>(table, rows), clock);
    const LogTable once = read_all(source);
    const auto other = source.another_walk();
    const LogTable again = read_all(*other);
    EXPECT_EQ(once.t, even.t) << rows;
    EXPECT_EQ(again.t, even.t) << rows;
    EXPECT_EQ(once.segment_starts, even.segment_starts) << rows;
  }
}

TEST(EvenTimes, RefusesAClockThatIsNone) {
  EXPECT_THROW(EvenTimes({.step = 0.0, .drift = 0.0}), InvalidArgument);
  EXPECT_THROW(EvenTimes({.step = 0.01, .drift = 0.5}), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::core::even_clock_test

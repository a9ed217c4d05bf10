// SPDX-License-Identifier: Apache-2.0
// A stream that brings no decisions is told once when it has lasted too long, and once when it is over.
#include "commission/watch/blind_watch.hpp"

#include <gtest/gtest.h>

#include "core/error.hpp"

namespace wheelwright::commission::blind_watch_test {
namespace {

constexpr double kStep = 0.01, kSettling = 2.0;

TEST(BlindWatch, SettlingAtTheStartAndBehindAPauseIsNoBlindness) {
  BlindWatch watch(kStep, kSettling);
  for (const double begin : {0.0, 1000.0}) {
    for (int k = 0; k < 200; ++k) {
      EXPECT_FALSE(watch.undecided(begin + kStep * k));
    }
    EXPECT_FALSE(watch.decided(begin + 2.0));
  }
}

TEST(BlindWatch, RowsWithoutATimeCountAtTheModelsRate) {
  BlindWatch watch(kStep, kSettling);
  EXPECT_FALSE(watch.decided(5.0));
  int told_at = 0;
  for (int k = 1; k <= 1000; ++k) {
    if (const auto spell = watch.undecided(std::nullopt)) {
      EXPECT_EQ(told_at, 0) << "told twice";
      told_at = k;
      EXPECT_EQ(spell->since, 5.0);
      EXPECT_EQ(spell->rows, static_cast<std::size_t>(k));
    }
  }
  EXPECT_EQ(told_at, 301);  // the first behind 3 s
  EXPECT_TRUE(watch.blind());
  const auto over = watch.decided(15.0);
  ASSERT_TRUE(over);
  EXPECT_EQ(over->rows, 1000u);
  EXPECT_DOUBLE_EQ(over->seconds, 10.0);
  EXPECT_FALSE(watch.blind());
  EXPECT_FALSE(watch.undecided(std::nullopt));
}

TEST(BlindWatch, ATooSlowStreamCountsByItsOwnClockAndOneThatRunsBackwardsToo) {
  for (const double step : {0.5, -0.5}) {
    BlindWatch watch(kStep, kSettling);
    int rows = 1;
    while (!watch.undecided(step * rows)) {
      ASSERT_LT(++rows, 100);
    }
    EXPECT_EQ(rows, 8);  // 3.5 s behind the first
    EXPECT_FALSE(watch.spell().since);
  }
}

// Seconds that are read as thousandths of them: what is decided there is of hardly any time.
TEST(BlindWatch, AClockThatHardlyGoesOnIsTold) {
  BlindWatch watch(kStep, kSettling);
  EXPECT_FALSE(watch.crawls(5.0));
  EXPECT_FALSE(watch.decided(5.0));
  EXPECT_TRUE(watch.crawls(5.0 + 0.9e-2 * kStep));
  EXPECT_FALSE(watch.crawls(5.0 + 1.1e-2 * kStep)) << "a hundred times as many rows are none too many";
  EXPECT_FALSE(watch.crawls(4.0)) << "another clock";
  int rows = 1;
  for (double t = 5.0 + 1e-5; !watch.undecided(t); t += 1e-5) {
    ASSERT_LT(++rows, 1000);
    ASSERT_TRUE(watch.crawls(t + 1e-5));
  }
  EXPECT_EQ(rows, 301);
}

TEST(BlindWatch, RefusesWhatIsNoTime) {
  EXPECT_THROW(BlindWatch(-1.0, kSettling), InvalidArgument);
  EXPECT_THROW(BlindWatch(kStep, -1.0), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::commission::blind_watch_test

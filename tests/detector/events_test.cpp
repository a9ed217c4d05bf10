// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <deque>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "detector/detector.hpp"
#include "detector/events.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::detector::events_test {
namespace {

using testing_support::Random;

TEST(DeadZone, IsZeroInsideAndTheSizeOutside) {
  EXPECT_EQ(dead_zone(0.5, 0.5), 0.0);
  EXPECT_EQ(dead_zone(-0.5, 0.5), 0.0);
  EXPECT_EQ(dead_zone(0.75, 0.5), 0.75);
  EXPECT_EQ(dead_zone(-0.75, 0.5), 0.75);
  EXPECT_EQ(dead_zone(-1.0, -1.0, 2.0), 0.0);
  EXPECT_EQ(dead_zone(2.0, -1.0, 2.0), 0.0);
  EXPECT_EQ(dead_zone(2.5, -1.0, 2.0), 2.5);
  EXPECT_EQ(dead_zone(-1.5, -1.0, 2.0), 1.5);
  EXPECT_EQ(dead_zone(0.5, 1.0, 2.0), 0.5);  // an interval that leaves zero out
}

TEST(DeadZone, Laws) {
  Random random(1);
  for (int k = 0; k < 10000; ++k) {
    const double e = 3.0 * random.symmetric(), lower = -2.0 * random.unit(), upper = 2.0 * random.unit();
    const double rho = std::max(upper, -lower);
    EXPECT_EQ(dead_zone(e, rho), dead_zone(-e, rho));
    EXPECT_EQ(dead_zone(e, rho), dead_zone(e, -rho, rho));
    EXPECT_GE(dead_zone(e, lower, upper), dead_zone(e, rho));          // two-sided is never less sensitive
    EXPECT_GE(dead_zone(e, rho), dead_zone(e, rho + random.unit()));   // nor a smaller threshold
    EXPECT_TRUE(dead_zone(e, rho) == 0.0 || dead_zone(e, rho) > rho);  // (35) jumps to the size
  }
}

TEST(Persistence, IsTheCountOverTheWindow) {
  for (std::size_t n = 1; n <= 64; n += n < 8 ? 1 : 14) {
    for (std::size_t k = 1; k <= n; k += n < 8 ? 1 : 9) {
      Random random(100 * n + k);
      PersistenceCounter counter({.k = k, .n = n});
      std::deque<bool> window;
      int alarms = 0;
      for (int i = 0; i < 3000; ++i) {
        if (i == 1500) {
          counter.reset();
          window.clear();
        }
        const bool outside = random.unit() < static_cast<double>(k) / static_cast<double>(n);
        window.push_back(outside);
        if (window.size() > n) {
          window.pop_front();
        }
        const auto count = static_cast<std::size_t>(std::count(window.begin(), window.end(), true));
        const bool alarm = counter.step(outside);
        alarms += alarm ? 1 : 0;
        ASSERT_EQ(alarm, count >= k) << k << " of " << n << " at " << i;
      }
      EXPECT_GT(alarms, 0);
    }
  }
}

TEST(Persistence, MisuseIsRefused) {
  EXPECT_THROW(PersistenceCounter({.k = 0, .n = 1}), InvalidArgument);
  EXPECT_THROW(PersistenceCounter({.k = 3, .n = 2}), InvalidArgument);
  EXPECT_THROW(PersistenceCounter({.k = 1, .n = 65}), InvalidArgument);
}

// Feeds a channel with residuals against [−1, 1] at 10 Hz; 1 of 1.
void feed(EventRecorder& recorder, std::size_t output, const std::vector<double>& residuals) {
  for (std::size_t k = 0; k < residuals.size(); ++k) {
    const bool outside = std::abs(residuals[k]) > 1.0;
    recorder.add(output, k, 0.1 * static_cast<double>(k), residuals[k], -1.0, 1.0, outside, outside);
  }
}

TEST(EventRecorder, KnowsStartEndPeakAndNumber) {
  EventRecorder recorder(1, 0.05);
  feed(recorder, 0, {0.0, 0.5, 1.5, -3.0, 2.0, 0.9, 0.0});
  // At 10 Hz and a merging time below the step, every instant outside is an event of its own.
  ASSERT_EQ(recorder.events().size(), 3u);

  EventRecorder merging(1, 0.15);
  feed(merging, 0, {0.0, 0.5, 1.5, -3.0, 2.0, 0.9, 0.0});
  ASSERT_EQ(merging.events().size(), 1u);
  const Event& e = merging.events()[0];
  EXPECT_EQ(e.start_sample, 2u);
  EXPECT_DOUBLE_EQ(e.start, 0.2);
  EXPECT_DOUBLE_EQ(e.alarm, 0.2);
  EXPECT_DOUBLE_EQ(e.end, 0.4);
  EXPECT_DOUBLE_EQ(e.peak_time, 0.3);
  EXPECT_DOUBLE_EQ(e.peak_residual, -3.0);
  EXPECT_DOUBLE_EQ(e.peak_ratio, 3.0);
  EXPECT_EQ(e.instants, 3u);
}

TEST(EventRecorder, MergesWhatIsNear) {
  const std::vector<double> series = {2.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 2.0};
  EventRecorder recorder(2, 0.35);
  feed(recorder, 1, series);
  ASSERT_EQ(recorder.events().size(), 2u);
  EXPECT_EQ(recorder.events()[0].output, 1u);
  EXPECT_EQ(recorder.events()[0].instants, 2u);
  EXPECT_DOUBLE_EQ(recorder.events()[0].end, 0.3);
  EXPECT_DOUBLE_EQ(recorder.events()[1].start, 0.8);
}

TEST(EventRecorder, ChannelsAreApart) {
  EventRecorder recorder(2, 10.0);
  feed(recorder, 0, {2.0, 0.0});
  feed(recorder, 1, {0.0, -2.0});
  ASSERT_EQ(recorder.events().size(), 2u);
  EXPECT_EQ(recorder.events()[0].output, 0u);
  EXPECT_EQ(recorder.events()[1].output, 1u);
}

TEST(EventRecorder, WithoutAnAlarmThereIsNoEvent) {
  EventRecorder recorder(1, 1.0);
  PersistenceCounter counter({.k = 3, .n = 4});
  const std::vector<double> series = {2.0, 2.0, 0.0, 0.0, 0.0, 0.0, 2.0, 2.0, 0.0, 2.0, 2.0, 0.0};
  int opened = 0;
  for (std::size_t k = 0; k < series.size(); ++k) {
    const bool outside = series[k] > 1.0;
    opened += recorder.add(0, k, static_cast<double>(k), series[k], -1.0, 1.0, outside, counter.step(outside)) ? 1 : 0;
    EXPECT_EQ(recorder.events().empty(), k < 9) << k;
  }
  EXPECT_EQ(opened, 1);
  const Event& e = recorder.events().front();
  EXPECT_EQ(e.alarm, 9.0);
  EXPECT_EQ(e.end, 10.0);
}

}  // namespace
}  // namespace wheelwright::detector::events_test

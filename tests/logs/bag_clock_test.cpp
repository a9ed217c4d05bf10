// SPDX-License-Identifier: Apache-2.0
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "formats/logs/bag_log.hpp"

namespace wheelwright::logs::bag_clock_test {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

constexpr std::int64_t ms = 1'000'000;

// A topic of 100 messages, recorded `delay` after its stamps, which are of a clock that is `offset` ahead.
TopicTimes topic(const std::string& name, std::int64_t step, std::int64_t delay, std::int64_t offset, bool stamped) {
  TopicTimes times;
  times.topic = name;
  for (int k = 1; k <= 100; ++k) {
    const std::int64_t at = 1'700'000'000'000 * ms + k * step;
    times.log_times.push_back(at + delay + (k % 7) * 100'000);
    times.stamps.push_back(stamped ? std::optional(at + offset) : std::nullopt);
  }
  return times;
}

TEST(BagClocks, StampsOfOneClockAreTakenAsTheyAre) {
  const BagClocks found = bag_clocks({topic("/a", 5 * ms, 2 * ms, 0, true), topic("/b", 20 * ms, 60 * ms, 0, true)});
  EXPECT_TRUE(found.clocks[0].stamped && found.clocks[1].stamped);
  EXPECT_EQ(found.clocks[1].shift, 0) << "a slow transport is no other clock";
  EXPECT_EQ(found.clocks[0].median_step, 5 * ms);
  EXPECT_EQ(found.clocks[1].median_step, 20 * ms);
  EXPECT_THAT(found.notes, IsEmpty());
}

TEST(BagClocks, AnotherClockIsShiftedToTheRows) {
  const std::int64_t ahead = -1'600'000'000'000 * ms;
  const BagClocks found = bag_clocks({topic("/a", 5 * ms, 2 * ms, 0, true), topic("/b", 5 * ms, 2 * ms, ahead, true)});
  EXPECT_EQ(found.clocks[1].shift, -ahead);
  ASSERT_EQ(found.notes.size(), 1U);
  EXPECT_THAT(found.notes[0], HasSubstr("/b: its time stamps are of another clock than those of /a"));
}

TEST(BagClocks, WithoutStampsTheTimeOfRecordingIsBroughtToTheRowsClock) {
  const std::int64_t ahead = 5'000 * ms;
  const BagClocks found = bag_clocks({topic("/a", 5 * ms, 2 * ms, ahead, true), topic("/b", 5 * ms, 2 * ms, 0, false)});
  EXPECT_FALSE(found.clocks[1].stamped);
  EXPECT_NEAR(static_cast<double>(found.clocks[1].shift), static_cast<double>(ahead - 2 * ms), 0.7 * ms);
  EXPECT_GT(found.clocks[1].jitter, 0);
  EXPECT_LE(found.clocks[1].jitter, ms);
  ASSERT_EQ(found.notes.size(), 1U);
  EXPECT_THAT(found.notes[0], HasSubstr("/b: its messages have no time stamp of their own"));
}

TEST(BagClocks, OneMissingStampMakesATopicUnstampedUnlessItsClockBeginsAtZero) {
  TopicTimes times = topic("/a", 5 * ms, 0, 0, true);
  times.stamps[40].reset();
  EXPECT_FALSE(bag_clocks({times}).clocks[0].stamped);
  TopicTimes simulated;
  for (int k = 0; k < 10; ++k) {
    simulated.log_times.push_back(k * 5 * ms);
    simulated.stamps.push_back(k == 0 ? std::nullopt : std::optional<std::int64_t>(k * 5 * ms));
  }
  const BagClocks found = bag_clocks({simulated});
  EXPECT_TRUE(found.clocks[0].stamped && found.clocks[0].zero_is_time);
}

TEST(BagClocks, NoMessagesAreNoClockAndNoCrash) {
  const BagClocks found = bag_clocks({TopicTimes{}, TopicTimes{}});
  EXPECT_EQ(found.clocks.size(), 2U);
  EXPECT_FALSE(found.clocks[0].stamped);
}

}  // namespace
}  // namespace wheelwright::logs::bag_clock_test

// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "formats/logs/row_log.hpp"

namespace wheelwright::logs::stream_aligner_test {
namespace {

constexpr std::int64_t ms = 1'000'000;

AlignedStream stream(std::size_t column, std::int64_t longest_gap, bool angle = false) {
  AlignedStream of;
  of.columns = {column};
  of.angle = {angle};
  of.longest_gap = longest_gap;
  return of;
}

struct Row {
  std::int64_t time = 0;
  std::array<double, 2> values{};
};

std::vector<Row> drain(StreamAligner& aligner) {
  std::vector<Row> rows;
  Row row;
  while (aligner.pop(row.time, row.values)) {
    rows.push_back(row);
  }
  return rows;
}

void push(StreamAligner& aligner, std::size_t of, std::int64_t time, double value) {
  aligner.push(of, time, std::span(&value, 1));
}

TEST(StreamAligner, InterpolatesStraightLinesExactly) {
  StreamAligner aligner(2, {stream(0, 0), stream(1, 100 * ms)});
  for (int k = 0; k <= 10; ++k) {
    push(aligner, 1, 20 * ms * k, 3.0 * k);
  }
  for (int k = 0; k <= 20; ++k) {
    push(aligner, 0, 10 * ms * k, k);
  }
  const std::vector<Row> rows = drain(aligner);
  ASSERT_EQ(rows.size(), 21U);
  for (int k = 0; k <= 20; ++k) {
    EXPECT_EQ(rows[static_cast<std::size_t>(k)].time, 10 * ms * k);
    EXPECT_DOUBLE_EQ(rows[static_cast<std::size_t>(k)].values[1], 1.5 * k);
  }
  EXPECT_NEAR(aligner.error()[1], 0.0, 1e-12);
  EXPECT_EQ(aligner.error()[0], 0.0);
}

// The promise of the header: sines of at least eight samples a period, any clocks.
TEST(StreamAligner, TheErrorBoundHoldsForSampledSines) {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  for (int trial = 0; trial < 50; ++trial) {
    const double step = (2.0 + 20.0 * share(random)) * 1e6, own = (1.0 + 10.0 * share(random)) * 1e6;
    const double omega = 2.0 * M_PI / (step * (8.0 + 30.0 * share(random)));
    const auto signal = [&](std::int64_t time) { return std::sin(omega * static_cast<double>(time) + trial); };
    StreamAligner aligner(2, {stream(0, 0), stream(1, static_cast<std::int64_t>(5.0 * step))});
    std::int64_t other = 0;
    double worst = 0.0, bound = 0.0;
    std::vector<Row> rows;
    for (std::int64_t time = 0; time < static_cast<std::int64_t>(300.0 * own); time += static_cast<std::int64_t>(own)) {
      push(aligner, 0, time, 0.0);
      for (; other <= time + static_cast<std::int64_t>(step); other += static_cast<std::int64_t>(step)) {
        push(aligner, 1, other, signal(other));
      }
      for (const Row& row : drain(aligner)) {
        worst = std::max(worst, std::abs(row.values[1] - signal(row.time)));
      }
    }
    bound = aligner.error()[1];
    EXPECT_LE(worst, bound * (1.0 + 1e-12));
    EXPECT_LE(bound, 1.5 * omega * omega * step * step / 8.0) << "and the bound is not far above the theory's";
  }
}

TEST(StreamAligner, NeverReachesAcrossAGapNorBeyondTheEnds) {
  StreamAligner aligner(2, {stream(0, 0), stream(1, 50 * ms)});
  push(aligner, 1, 20 * ms, 1.0);
  push(aligner, 1, 40 * ms, 2.0);
  push(aligner, 1, 140 * ms, 3.0);
  for (const int at : {10, 20, 30, 40, 50, 140, 150}) {
    push(aligner, 0, at * ms, 0.0);
  }
  aligner.finish();
  const std::vector<Row> rows = drain(aligner);
  ASSERT_EQ(rows.size(), 7U);
  EXPECT_TRUE(std::isnan(rows[0].values[1])) << "before the first";
  EXPECT_EQ(rows[1].values[1], 1.0) << "on a sample";
  EXPECT_EQ(rows[2].values[1], 1.5);
  EXPECT_EQ(rows[3].values[1], 2.0) << "the last before a gap";
  EXPECT_TRUE(std::isnan(rows[4].values[1])) << "inside the gap";
  EXPECT_EQ(rows[5].values[1], 3.0);
  EXPECT_TRUE(std::isnan(rows[6].values[1])) << "behind the last";
}

TEST(StreamAligner, AnglesGoTheShortWayRound) {
  StreamAligner aligner(2, {stream(0, 0), stream(1, 100 * ms, true)});
  const double speed = 40.0;  // rad/s: 0.4 rad a sample
  for (int k = 0; k <= 100; ++k) {
    const double angle = speed * 0.01 * k;
    push(aligner, 1, 10 * ms * k, std::atan2(std::sin(angle), std::cos(angle)));
    push(aligner, 0, 10 * ms * k + 5 * ms, 0.0);
  }
  for (const Row& row : drain(aligner)) {
    EXPECT_NEAR(row.values[1], speed * 1e-9 * static_cast<double>(row.time), 1e-9);
  }
}

TEST(StreamAligner, WaitsForASlowTopicButNotForASilentOne) {
  StreamAligner aligner(2, {stream(0, 0), stream(1, 1000 * ms)}, 2000 * ms);
  push(aligner, 1, 0, 1.0);
  for (int k = 0; k < 200; ++k) {
    push(aligner, 0, 10 * ms * k + ms, 0.0);
  }
  EXPECT_TRUE(drain(aligner).empty()) << "the next sample may come yet";
  push(aligner, 0, 4000 * ms, 0.0);
  const std::vector<Row> rows = drain(aligner);
  ASSERT_EQ(rows.size(), 200U) << "all rows but the newest are more than the patience behind";
  EXPECT_TRUE(std::isnan(rows.back().values[1]));
}

TEST(StreamAligner, LeavesOutWhatComesTwiceOrLate) {
  StreamAligner aligner(2, {stream(0, 0), stream(1, 100 * ms)});
  push(aligner, 1, 0, 0.0);
  push(aligner, 1, 20 * ms, 2.0);
  push(aligner, 1, 20 * ms, 9.0);
  push(aligner, 1, 10 * ms, 9.0);
  push(aligner, 0, 10 * ms, 0.0);
  const std::vector<Row> rows = drain(aligner);
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].values[1], 1.0);
  EXPECT_EQ(aligner.stale(1), 2U);
}

TEST(StreamAligner, TimesThatMayBeWrongWidenTheBoundByTheSlope) {
  AlignedStream late = stream(1, 100 * ms);
  late.time_error = ms;
  StreamAligner aligner(2, {stream(0, 0), late});
  for (int k = 0; k < 10; ++k) {
    push(aligner, 1, 20 * ms * k, 0.5 * k);  // 25 per s
    push(aligner, 0, 20 * ms * k + 7 * ms, 0.0);
  }
  drain(aligner);
  EXPECT_NEAR(aligner.error()[1], 25.0 * 1e-3, 1e-12);
}

TEST(StreamAligner, RefusesNonsense) {
  EXPECT_THROW(StreamAligner(2, {}), InvalidArgument);
  EXPECT_THROW(StreamAligner(2, {stream(0, 0), stream(0, 0)}), InvalidArgument) << "one column twice";
  EXPECT_THROW(StreamAligner(1, {stream(1, 0)}), InvalidArgument) << "beyond the row";
  StreamAligner aligner(1, {stream(0, 0)});
  EXPECT_THROW(aligner.push(0, 0, {}), InvalidArgument);
}

TEST(StreamAligner, RefusesTimesWhoseDifferencesAreNoNumbers) {
  StreamAligner aligner(2, {stream(0, ms), stream(1, ms)});
  EXPECT_THROW(push(aligner, 0, std::numeric_limits<std::int64_t>::min(), 1.0), InvalidArgument);
  EXPECT_THROW(push(aligner, 1, farthest_time, 1.0), InvalidArgument);
  push(aligner, 1, -farthest_time + 1, 1.0);
  push(aligner, 0, farthest_time - 1, 1.0);
  push(aligner, 1, farthest_time - 1, 1.0);
  EXPECT_EQ(drain(aligner).size(), 1U);
}

}  // namespace
}  // namespace wheelwright::logs::stream_aligner_test

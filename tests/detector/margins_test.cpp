// SPDX-License-Identifier: Apache-2.0
// Margins along drives, and that they are kept: a certain fault is seen in time, a hidden one is not.
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/limits.hpp"
#include "detector/faults/margins.hpp"
#include "detector/threshold.hpp"
#include "tests/detector/detectability.hpp"

namespace wheelwright::detector::margins_test {
namespace {

using testing_support::Breakage;
using testing_support::breakages;
using testing_support::Commissioned;
using testing_support::commissioned_robot;
using testing_support::FaultyRun;
using testing_support::Outcome;
using testing_support::Promise;
using testing_support::promise;
using testing_support::random_run;
using testing_support::watch;

// What is certain is so for noise at its declared bounds, which it reaches here. What is hidden is so for noise of a
// share of them: half of it is there then, and what interpolation adds.
constexpr double kShare = 0.75;

FaultyRun with_half_the_noise(FaultyRun run) {
  run.drive.sensors.effort *= 0.5;
  *run.drive.sensors.encoder_counts_per_turn *= 2.0;
  return run;
}

struct Tally {
  int certain = 0, hidden = 0;
};

// A fault of the smallest certain size for the motion that it leaves the robot: found by turns, since the size changes
// the motion and the motion the size.
std::optional<double> certain_on_its_own_motion(const FaultyRun& run, double window) {
  double size = promise(run, 0.0, window, 1.0).certain;
  for (int turn = 0; turn < 12 && size < core::kInfinity; ++turn) {
    const double needed = promise(run, run.side * size, window, 1.0).certain;
    if (needed <= size) {
      return size;
    }
    size = needed * 1.001;
    if (size > (run.side > 0.0 ? run.fault.range.upper : -run.fault.range.lower)) {
      break;
    }
  }
  return std::nullopt;
}

void try_runs(std::uint64_t robot_seed, int runs, Tally& tally) {
  const Commissioned robot = commissioned_robot(robot_seed);
  for (int k = 0; k < runs; ++k) {
    const std::uint64_t seed = 1000 * robot_seed + static_cast<std::uint64_t>(k);
    const Breakage& breakage = breakages()[static_cast<std::size_t>(k) % breakages().size()];
    const FaultyRun run = random_run(robot, seed, breakage);
    const double window = std::vector<double>{0.3, 1.0, 2.0}[seed % 3];
    if (const auto size = certain_on_its_own_motion(run, window)) {
      const Outcome outcome = watch(run, run.side * *size);
      ++tally.certain;
      ASSERT_FALSE(outcome.early) << breakage.fault << ", seed " << seed;
      // The fault is between two samples: it is promised from the second of them on.
      ASSERT_LE(outcome.first, window + 1.0 / run.drive.rate)
          << breakage.fault << " of " << run.side * *size << ", seed " << seed;
    }
    // Half of the smallest possible size, again for the motion that it leaves the robot.
    double small = 0.5 * promise(run, 0.0, window, kShare).hidden;
    for (int turn = 0; turn < 60 && run.simulated; ++turn) {
      const double half = 0.5 * promise(run, run.side * small, window, kShare).hidden;
      if (small <= half) {
        break;
      }
      small = std::min(0.7 * small, half);
    }
    const Outcome outcome = watch(with_half_the_noise(run), run.side * small);
    ++tally.hidden;
    ASSERT_FALSE(outcome.early) << breakage.fault << ", seed " << seed;
    ASSERT_GT(outcome.first, window) << breakage.fault << " of " << run.side * small << ", seed " << seed;
  }
}

TEST(Margins, AreKept) {
  Tally tally;
  for (std::uint64_t robot = 1; robot <= 3; ++robot) {
    try_runs(robot, 10, tally);
  }
  EXPECT_GE(tally.certain, 20);
  EXPECT_EQ(tally.hidden, 30);
}

TEST(Margins, RefuseWhatMakesNoSense) {
  Box box;
  box.sides = {{1.0, 2.0}};
  const ThresholdRule rule(Polytope({}, box), Eigen::VectorXd::Ones(1));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<MarginOptions> bad(5);
  bad[0].windows = {1.0, 0.5};
  bad[1].windows = {};
  bad[2].onset_step = nan;
  bad[3].noise_share = nan;
  bad[4].noise_share = 1.5;
  for (const MarginOptions& options : bad) {
    EXPECT_THROW(static_cast<void>(margins_along({}, {}, rule, {}, options)), InvalidArgument);
  }
}

class SlowMarginsPart : public ::testing::TestWithParam<std::uint64_t> {};

TEST_P(SlowMarginsPart, AreKeptInFiveHundredRuns) {
  Tally tally;
  for (std::uint64_t robot = 1; robot <= 50; ++robot) {
    try_runs(100 + 50 * GetParam() + robot, 10, tally);
  }
  RecordProperty("certain", tally.certain);
  EXPECT_GE(tally.certain, 350);
  EXPECT_EQ(tally.hidden, 500);
}

INSTANTIATE_TEST_SUITE_P(Quarters, SlowMarginsPart, ::testing::Range<std::uint64_t>(0, 4));

}  // namespace
}  // namespace wheelwright::detector::margins_test

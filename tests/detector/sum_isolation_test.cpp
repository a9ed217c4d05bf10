// SPDX-License-Identifier: Apache-2.0
// Sums over all scales after an alarm: they exclude more faults, and never the true one.
#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "commission/watch/detector_walk.hpp"
#include "detector/faults/reference_motion.hpp"
#include "detector/multiscale/sum_isolation.hpp"
#include "detector/multiscale/sum_response.hpp"
#include "detector/online_model.hpp"
#include "tests/detector/detectability.hpp"

namespace wheelwright::detector::sum_isolation_test {
namespace {

using testing_support::Breakage;
using testing_support::breakages;
using testing_support::Commissioned;
using testing_support::commissioned_at_risk;
using testing_support::FaultyRun;
using testing_support::log_of;
using testing_support::promise;
using testing_support::random_run;

using Verdict = FaultFinding::Verdict;

struct Tally {
  std::vector<std::size_t> before, after;  // faults that are left, per alarm

  [[nodiscard]] static std::size_t median(std::vector<std::size_t> counts) {
    std::ranges::sort(counts);
    return counts.empty() ? 0 : counts[counts.size() / 2];
  }
};

// Faults of twice the size that is certain for every noise within a second, on drives that go on for 20 s.
void try_runs(std::uint64_t robot_seed, int runs, Tally& tally) {
  const Commissioned robot = commissioned_at_risk(robot_seed);
  const OnlineModel& m = robot.model;
  for (int k = 0; k < runs; ++k) {
    const std::uint64_t seed = 1000 * robot_seed + static_cast<std::uint64_t>(k);
    const Breakage& breakage = breakages()[static_cast<std::size_t>(k) % breakages().size()];
    FaultyRun run = random_run(robot, seed, breakage);
    run.drive.duration = 20.0;
    run.drive.robot.effort_changes = model::EffortChanges::at_samples;
    const double size = 2.0 * promise(run, 0.0, 1.0, 1.0).certain;
    const double largest = run.side > 0.0 ? run.fault.range.upper : -run.fault.range.lower;
    // Noise of the effort grows with what its reading is multiplied by.
    if (!(size <= 0.8 * largest) || (breakage.fault.starts_with("effort_loss") && size > 0.5)) {
      continue;
    }
    const double magnitude = run.side * size;
    const LogTable table = log_of(run, magnitude, true);
    TableSource log(table);
    const Detection detection = detect(log, make_detector(m));
    if (detection.events.empty()) {
      continue;
    }
    const Event& event = detection.events.front();
    const RegressorFilter filter(m.model, m.filter, m.measurement, m.errors);
    const ReferenceMotion motion = read_reference(log, filter);
    Isolation isolation = isolate(motion, filter, Polytope(m.facets, m.box), fault_catalogue(m.model, m.estimate),
                                  event.start, event.alarm);
    tally.before.push_back(isolation.count(Verdict::consistent));
    const auto drive = read_sum_drive(log, m, motion, {.any_log = false});
    ASSERT_TRUE(drive);
    narrow_by_sums(isolation, *drive, m, motion, event.alarm);
    tally.after.push_back(isolation.count_at_risk());
    EXPECT_LE(tally.after.back(), tally.before.back());
    const auto truth =
        std::ranges::find(isolation.findings, breakage.fault, [](const FaultFinding& f) { return f.fault.name; });
    ASSERT_NE(truth, isolation.findings.end());
    ASSERT_EQ(truth->verdict, Verdict::consistent) << breakage.fault << " of " << magnitude << ", seed " << seed;
    if (!truth->at_risk) {
      EXPECT_TRUE(truth->earlier);
      continue;
    }
    const SumFinding& sums = *truth->at_risk;
    ASSERT_FALSE(sums.excluded) << breakage.fault << " of " << magnitude << ", seed " << seed;
    EXPECT_TRUE(sums.magnitude->contains(magnitude))
        << breakage.fault << " of " << magnitude << ", seed " << seed << ": " << sums.magnitude->lower << " to "
        << sums.magnitude->upper;
    EXPECT_TRUE(sums.onset.contains(run.onset)) << breakage.fault << " at " << run.onset << ", seed " << seed << ": "
                                                << sums.onset.lower << " to " << sums.onset.upper;
  }
}

TEST(SumIsolation, LeavesFewerFaultsAndTheTrueOne) {
  Tally tally;
  for (const std::uint64_t robot : {1, 2}) {
    try_runs(robot, 10, tally);
  }
  EXPECT_GE(tally.before.size(), 8U);
  RecordProperty("before", static_cast<int>(Tally::median(tally.before)));
  RecordProperty("after", static_cast<int>(Tally::median(tally.after)));
  EXPECT_LT(Tally::median(tally.after), Tally::median(tally.before));
}

class SlowSumIsolation : public ::testing::TestWithParam<std::uint64_t> {};

// 64 robots a part, ten runs each; all parts are some ten thousand isolations.
TEST_P(SlowSumIsolation, NeverExcludesTheTrueFault) {
  constexpr std::uint64_t kRobots = 64;
  Tally tally;
  for (std::uint64_t robot = 0; robot < kRobots; ++robot) {
    try_runs(40 + kRobots * GetParam() + robot, 10, tally);
    ASSERT_FALSE(HasFatalFailure());
  }
  EXPECT_GE(tally.before.size(), 240U);
  RecordProperty("runs", static_cast<int>(tally.before.size()));
  RecordProperty("before", static_cast<int>(Tally::median(tally.before)));
  RecordProperty("after", static_cast<int>(Tally::median(tally.after)));
  EXPECT_LT(Tally::median(tally.after), Tally::median(tally.before));
}

INSTANTIATE_TEST_SUITE_P(Robots, SlowSumIsolation, ::testing::Range<std::uint64_t>(0, 21));

}  // namespace
}  // namespace wheelwright::detector::sum_isolation_test

// SPDX-License-Identifier: Apache-2.0
// After an alarm a true step that stays is never excluded, and its size and onset lie in the intervals.
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "commission/watch/detector_walk.hpp"
#include "detector/faults/isolation.hpp"
#include "detector/faults/reference_motion.hpp"
#include "detector/online_model.hpp"
#include "tests/detector/detectability.hpp"

namespace wheelwright::detector::isolation_test {
namespace {

using testing_support::Breakage;
using testing_support::breakages;
using testing_support::Commissioned;
using testing_support::commissioned_robot;
using testing_support::FaultyRun;
using testing_support::log_of;
using testing_support::promise;
using testing_support::random_run;

using Verdict = FaultFinding::Verdict;

RegressorFilter filter_of(const OnlineModel& m) { return {m.model, m.filter, m.measurement, m.errors}; }

// What the detector's first alarm on `table` is isolated to; nothing where there is none. An alarm before `onset`
// fails.
std::optional<Isolation> isolated(const OnlineModel& m, const LogTable& table, double onset,
                                  const IsolationOptions& options = {}) {
  TableSource log(table);
  const Detection detection = detect(log, make_detector(m));
  if (detection.events.empty()) {
    return std::nullopt;
  }
  EXPECT_GE(detection.events.front().start, onset);
  const Event& event = detection.events.front();
  const RegressorFilter filter = filter_of(m);
  const ReferenceMotion motion = read_reference(log, filter);
  return isolate(motion, filter, Polytope(m.facets, m.box), fault_catalogue(m.model, m.estimate), event.start,
                 event.alarm, options);
}

const FaultFinding& finding(const Isolation& isolation, const std::string& name) {
  const auto found = std::find_if(isolation.findings.begin(), isolation.findings.end(),
                                  [&](const FaultFinding& f) { return f.fault.name == name; });
  if (found == isolation.findings.end()) {
    throw InvalidArgument("no fault '" + name + "'");
  }
  return *found;
}

struct Tally {
  int runs = 0, consistent = 0, silent = 0;
};

// Runs of one robot: the fault that was made, of a few times the smallest certain size of the healthy motion (which is
// certain for a broken reading; a robot that is broken itself moves otherwise). Whatever alarms: the truth is kept.
void try_runs(std::uint64_t robot_seed, int first, int runs, Tally& tally) {
  const Commissioned robot = commissioned_robot(robot_seed);
  for (int k = first; k < first + runs; ++k) {
    const std::uint64_t seed = 1000 * robot_seed + static_cast<std::uint64_t>(k);
    const Breakage& breakage = breakages()[static_cast<std::size_t>(k) % breakages().size()];
    const FaultyRun run = random_run(robot, seed, breakage);
    const double size = (1.05 + static_cast<double>(seed % 4)) * promise(run, 0.0, 1.0, 1.0).certain;
    const double largest = run.side > 0.0 ? run.fault.range.upper : -run.fault.range.lower;
    // Noise of the effort grows with what its reading is multiplied by.
    const bool loss = breakage.fault.starts_with("effort_loss");
    if (!(size <= 0.8 * largest) || (loss && size > 0.5)) {
      continue;
    }
    const double magnitude = run.side * size;
    const auto isolation = isolated(robot.model, log_of(run, magnitude, true), run.onset);
    if (!isolation) {
      ++tally.silent;
      continue;
    }
    ++tally.runs;
    tally.consistent += static_cast<int>(isolation->count(Verdict::consistent));
    const FaultFinding& truth = finding(*isolation, breakage.fault);
    ASSERT_EQ(truth.verdict, Verdict::consistent) << breakage.fault << " of " << magnitude << ", seed " << seed;
    ASSERT_TRUE(truth.magnitude->contains(magnitude))
        << breakage.fault << " of " << magnitude << ", seed " << seed << ": " << truth.magnitude->lower << " to "
        << truth.magnitude->upper;
    ASSERT_TRUE(truth.onset.contains(run.onset) || (truth.earlier && run.onset < truth.onset.lower))
        << breakage.fault << " at " << run.onset << ", seed " << seed << ": " << truth.onset.lower << " to "
        << truth.onset.upper;
  }
}

TEST(Isolation, KeepsTheTrueFault) {
  Tally tally;
  try_runs(1, 0, 10, tally);
  try_runs(2, 0, 10, tally);
  EXPECT_GE(tally.runs, 8);
  EXPECT_LT(tally.consistent, 14 * tally.runs);  // of more than twenty
}

class SlowIsolationPart : public ::testing::TestWithParam<std::uint64_t> {};

// The truth is excluded in none of 60 isolations and more: if it happened in a share q of them, that would be seen with
// a probability of 1 − (1 − q)⁶⁰, so that q < 5 % at a confidence of 95 % (0.95⁶⁰ = 0.046), of both halves together 2.5
// %.
TEST_P(SlowIsolationPart, KeepsTheTrueFaultInEveryOneOfSixtyRuns) {
  Tally tally;
  for (std::uint64_t robot = 1; tally.runs < 60; ++robot) {
    ASSERT_LE(robot, 30U) << tally.runs << " isolations of 300 faults";
    try_runs(300 + 40 * GetParam() + robot, 0, 10, tally);
    ASSERT_FALSE(HasFatalFailure());
  }
  RecordProperty("runs", tally.runs);
  RecordProperty("silent", tally.silent);
  RecordProperty("consistent", tally.consistent);
}

INSTANTIATE_TEST_SUITE_P(Halves, SlowIsolationPart, ::testing::Range<std::uint64_t>(0, 2));

// A precise robot on a long varied drive, and what its log becomes.
class PreciseRobot : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    Scenario s = testing_support::noisy_drive(5, 20.0);
    s.robot.encoder_counts_per_turn = 32768.0;
    s.sensors.encoder_counts_per_turn = 65536.0;
    s.robot.noise.effort.value = 0.005;
    s.sensors.effort = 0.0025;
    Simulation log(s);
    const Commissioning result = commission_robot(log, s.robot);
    ASSERT_EQ(result.status, Commissioning::Status::done) << result.message;
    model() = result.model;
    s.trajectory.kind = sim::Trajectory::Kind::multi_sine;
    s.seed = 6;
    drive() = s;
  }
  static OnlineModel& model() {
    static OnlineModel m;
    return m;
  }
  static Scenario& drive() {
    static Scenario s;
    return s;
  }
  static constexpr double kOnset = 8.003;

  static LogTable healthy() {
    Simulation log(drive());
    return read_all(log);
  }
  static LogTable broken(model::Fault::Kind kind, double magnitude) {
    Scenario s = drive();
    s.faults = {{.kind = kind, .magnitude = magnitude, .profile = {.onset = kOnset}}};
    Simulation log(s);
    return read_all(log);
  }
  // f(t, efforts of both wheels) for every row from the onset on.
  template <class Change>
  static LogTable changed(const Change& change) {
    LogTable log = healthy();
    std::vector<double>&right = log.column("tau_r"), &left = log.column("tau_l");
    for (std::size_t k = 0; k < log.rows(); ++k) {
      if (log.t[k] >= kOnset) {
        change(log.t[k], right[k], left[k]);
      }
    }
    return log;
  }
};

TEST_F(PreciseRobot, SizesAWheelRadiusToAShareOfItself) {
  const double r = drive().robot.wheel_radius;
  const auto isolation = isolated(model(), broken(model::Fault::Kind::wheel_radius_right, 0.1 * r), kOnset);
  ASSERT_TRUE(isolation);
  const FaultFinding& truth = finding(*isolation, "wheel_radius_right");
  ASSERT_EQ(truth.verdict, Verdict::consistent);
  EXPECT_TRUE(truth.magnitude->contains(0.1));
  EXPECT_GT(truth.magnitude->lower, 0.05);
  EXPECT_LT(truth.magnitude->upper, 0.15);
  EXPECT_EQ(finding(*isolation, "wheel_radius_left").verdict, Verdict::excluded);
  EXPECT_EQ(finding(*isolation, "payload_lost").verdict, Verdict::excluded);
  EXPECT_EQ(finding(*isolation, "effort_loss_left").verdict, Verdict::excluded);
}

TEST_F(PreciseRobot, TellsTheSideOfALostEffort) {
  const auto isolation =
      isolated(model(), changed([](double, double& right, double&) { right *= 1.25; }), kOnset);  // a fifth is lost
  ASSERT_TRUE(isolation);
  const FaultFinding& truth = finding(*isolation, "effort_loss_right");
  ASSERT_EQ(truth.verdict, Verdict::consistent);
  EXPECT_TRUE(truth.magnitude->contains(0.2));
  EXPECT_GT(truth.magnitude->lower, 0.15);
  EXPECT_LT(truth.magnitude->upper, 0.25);
  EXPECT_EQ(finding(*isolation, "effort_loss_left").verdict, Verdict::excluded);
  EXPECT_EQ(finding(*isolation, "payload_lost").verdict, Verdict::excluded);
}

TEST_F(PreciseRobot, KnowsADeadSensorFromAStuckOne) {
  const auto dead = isolated(model(), changed([](double, double& right, double&) { right = 0.0; }), kOnset);
  ASSERT_TRUE(dead);
  EXPECT_EQ(finding(*dead, "effort_dead_right").verdict, Verdict::consistent);
  // Zero is where it may be stuck, too.
  EXPECT_EQ(finding(*dead, "effort_stuck_right").verdict, Verdict::consistent);
  EXPECT_EQ(finding(*dead, "effort_dead_left").verdict, Verdict::excluded);
  const auto stuck = isolated(model(), changed([](double, double& right, double&) { right = 0.4; }), kOnset);
  ASSERT_TRUE(stuck);
  EXPECT_EQ(finding(*stuck, "effort_stuck_right").verdict, Verdict::consistent);
  EXPECT_EQ(finding(*stuck, "effort_dead_right").verdict, Verdict::excluded);
  EXPECT_EQ(finding(*stuck, "effort_stuck_left").verdict, Verdict::excluded);
}

TEST_F(PreciseRobot, ExplainsNothingWhereTheCatalogueHasNothing) {
  const auto isolation = isolated(model(), changed([](double t, double& right, double& left) {
                                    right += 0.5 * std::sin(25.0 * t);
                                    left -= 0.3 * std::sin(17.0 * t);
                                  }),
                                  kOnset);
  ASSERT_TRUE(isolation);
  for (const FaultFinding& f : isolation->findings) {
    // An encoder that misses a tenth of a second is judged by its reading alone.
    if (!f.fault.name.starts_with("encoder_dropout")) {
      EXPECT_NE(f.verdict, Verdict::consistent) << f.fault.name;
    }
  }
}

TEST_F(PreciseRobot, GivesWiderAnswersForALimitedBudgetAndTheSameOnSeveralThreads) {
  const double r = drive().robot.wheel_radius;
  const LogTable table = broken(model::Fault::Kind::wheel_radius, -0.12 * r);
  const auto full = isolated(model(), table, kOnset), poor = isolated(model(), table, kOnset, {.budget = 5}),
             threads = isolated(model(), table, kOnset, {.threads = 3});
  ASSERT_TRUE(full && poor && threads);
  for (std::size_t k = 0; k < full->findings.size(); ++k) {
    const FaultFinding &f = full->findings[k], &g = poor->findings[k], &h = threads->findings[k];
    EXPECT_EQ(f.verdict, h.verdict) << f.fault.name;
    EXPECT_EQ(f.magnitude, h.magnitude) << f.fault.name;
    EXPECT_EQ(f.onset, h.onset) << f.fault.name;
    if (f.verdict == Verdict::consistent) {
      ASSERT_EQ(g.verdict, Verdict::consistent) << f.fault.name;
      EXPECT_LE(g.onset.lower, f.onset.lower) << f.fault.name;
      if (f.magnitude) {
        EXPECT_LE(g.magnitude->lower, f.magnitude->lower) << f.fault.name;
        EXPECT_GE(g.magnitude->upper, f.magnitude->upper) << f.fault.name;
      }
    }
  }
}

TEST(IsolationWords, NoSizeOfLateralSlipExplainsAnythingOnAStraightLine) {
  Scenario s = testing_support::noisy_drive(9, 14.0);
  Simulation learning(s);
  const Commissioning result = commission_robot(learning, s.robot);
  ASSERT_EQ(result.status, Commissioning::Status::done) << result.message;
  s.trajectory = {.kind = sim::Trajectory::Kind::straight, .speed = 0.5};
  s.duration = 10.0;
  s.faults = {{.kind = model::Fault::Kind::wheel_radius,
               .magnitude = -0.4 * s.robot.wheel_radius,
               .profile = {.onset = 5.003}}};
  Simulation log(s);
  const auto isolation = isolated(result.model, read_all(log), 5.003);
  ASSERT_TRUE(isolation);
  EXPECT_EQ(finding(*isolation, "wheel_radius").verdict, Verdict::consistent);
  EXPECT_EQ(finding(*isolation, "unmatched").verdict, Verdict::excluded);
}

TEST(IsolationWords, MisuseThrows) {
  const Commissioned robot = commissioned_robot(1);
  const RegressorFilter filter = filter_of(robot.model);
  const LogTable table = sim::simulate(robot.scenario);
  TableSource log(table);
  const ReferenceMotion motion = read_reference(log, filter);
  const Polytope set(robot.model.facets, robot.model.box);
  EXPECT_THROW((void)isolate(motion, filter, set, {}, 5.0, 1e6), InvalidArgument);
  EXPECT_THROW((void)isolate(motion, filter, set, {}, 5.0, 5.0, {.before = 0.0}), InvalidArgument);
  EXPECT_THROW((void)isolate(motion, filter, set, {}, 5.0, 5.0, {.resolution = std::nan("")}), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::detector::isolation_test

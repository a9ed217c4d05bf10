// SPDX-License-Identifier: Apache-2.0
// Both residuals tell faults apart together: the true step that stays is never excluded, whatever alarms and whether
// the other residual shows it or not.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "commission/watch/detector_walk.hpp"
#include "commission/watch/incident_watch.hpp"
#include "detector/faults/odometry_isolation.hpp"
#include "detector/online_model.hpp"
#include "tests/detector/detectability.hpp"
#include "tests/support/kinematic_drives.hpp"

namespace wheelwright::detector::odometry_isolation_test {
namespace {

using testing_support::Breakage;
using testing_support::breakages;
using testing_support::Commissioned;
using testing_support::FaultyRun;
using testing_support::log_of;
using testing_support::Random;
using testing_support::random_robot;
using testing_support::random_run;

using Verdict = FaultFinding::Verdict;

LogTable without(LogTable log, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    const auto at = std::ranges::find(log.names, name) - log.names.begin();
    log.names.erase(log.names.begin() + at);
    log.columns.erase(log.columns.begin() + at);
  }
  return log;
}

// A robot with a pose, or with a heading alone.
struct Posed : Commissioned {
  bool position = true;

  [[nodiscard]] LogTable seen(const LogTable& log) const { return position ? log : without(log, {"x", "y"}); }
};

Posed posed_robot(std::uint64_t seed, bool position) {
  Posed robot{{testing_support::with_pose(random_robot(seed)), {}}, position};
  Scenario& s = robot.scenario;
  s.duration = 24.0;
  Simulation source(s);
  const LogTable table = robot.seen(read_all(source));
  TableSource log(table);
  const Commissioning result = commission_robot(log, s.robot);
  if (result.status != Commissioning::Status::done || !result.model.kinematic) {
    throw InvalidArgument("seed " + std::to_string(seed) + ": " + result.message + result.kinematic.message);
  }
  robot.model = result.model;
  return robot;
}

double size_of(const std::string& fault, Random& random) {
  const double share = 1.0 + random.unit();
  return fault == "matched" || fault == "unmatched" ? 0.08 * share
         : fault == "slip_yaw"                      ? 0.15 * share
         : fault.starts_with("effort_bias")         ? 0.5 * share
         : fault.starts_with("effort_loss")         ? 0.2 * share
                                                    : 0.08 * share;
}

const FaultFinding& finding(const Isolation& isolation, const std::string& name) {
  const auto found = std::ranges::find(isolation.findings, name, [](const FaultFinding& f) { return f.fault.name; });
  if (found == isolation.findings.end()) {
    throw InvalidArgument("no fault '" + name + "'");
  }
  return *found;
}

struct Tally {
  int torque = 0, kinematic = 0;           // isolations
  std::size_t by_torque = 0, by_both = 0;  // candidates left at alarms of the torque residual, without and with a pose
  std::size_t left = 0;                    // candidates left at alarms of the kinematic residual
  std::vector<std::size_t> incidents{};
};

void holds(const Isolation& isolation, const std::string& fault, double magnitude, double onset,
           const std::string& what) {
  const FaultFinding& truth = finding(isolation, fault);
  ASSERT_EQ(truth.verdict, Verdict::consistent) << what;
  ASSERT_TRUE(truth.magnitude->contains(magnitude))
      << what << ": " << truth.magnitude->lower << " to " << truth.magnitude->upper;
  ASSERT_TRUE(onset <= truth.onset.upper && (truth.earlier || onset >= truth.onset.lower))
      << what << ", at " << onset << ": " << truth.onset.lower << " to " << truth.onset.upper;
}

// Some faults alone are found to be what they are among all; the others are not examined.
void is_the_same_of_some(core::LogSource& log, const OnlineModel& model, std::span<const Event> event,
                         const Isolation& all) {
  commission::EventIsolationOptions some;
  for (std::size_t k = 0; k < all.findings.size(); k += 3) {
    some.only.push_back(all.findings[k].fault.name);
  }
  const Isolation found = commission::isolate_events(log, model, event, some).front();
  ASSERT_EQ(found.findings.size(), all.findings.size());
  for (std::size_t k = 0; k < all.findings.size(); ++k) {
    const FaultFinding &a = found.findings[k], &b = all.findings[k];
    if (k % 3 != 0) {
      EXPECT_EQ(a.verdict, Verdict::not_examined) << b.fault.name;
      continue;
    }
    ASSERT_EQ(a.verdict, b.verdict) << b.fault.name;
    if (a.verdict == Verdict::consistent) {
      EXPECT_EQ(a.magnitude, b.magnitude) << b.fault.name;
      EXPECT_EQ(a.onset, b.onset) << b.fault.name;
      EXPECT_EQ(a.earlier, b.earlier) << b.fault.name;
    }
  }
}

void try_runs(std::uint64_t robot_seed, bool position, Tally& tally) {
  const Posed robot = posed_robot(robot_seed, position);
  OnlineModel blind = robot.model;
  blind.kinematic.reset();
  Random random(robot_seed);
  for (std::size_t k = 0; k < breakages().size(); ++k) {
    const std::uint64_t seed = 1000 * robot_seed + k;
    const Breakage& breakage = breakages()[k];
    FaultyRun run = random_run(robot, seed, breakage);
    run.drive.duration = 14.0;
    const double magnitude = run.side * size_of(breakage.fault, random);
    const LogTable table = robot.seen(log_of(run, magnitude, true));
    TableSource log(table);
    const Detection detection = detect(log, make_detector(robot.model));
    const commission::KinematicWatch kinematic = commission::watch_kinematics(log, robot.model, {});
    ASSERT_TRUE(kinematic.detection) << kinematic.message;
    const std::string what =
        breakage.fault + " of " + std::to_string(magnitude) + ", seed " + std::to_string(seed) + ", ";
    const auto first = [](const Detection& d) {
      return std::span(d.events.data(), std::min<std::size_t>(d.events.size(), 1));
    };
    const auto torque = commission::isolate_events(log, robot.model, first(detection));
    if (!torque.empty()) {
      ++tally.torque;
      holds(torque.front(), breakage.fault, magnitude, run.onset, what + "alarm of the torque residual");
      is_the_same_of_some(log, robot.model, first(detection), torque.front());
      const auto alone = commission::isolate_events(log, blind, first(detection));
      tally.by_torque += alone.front().count(Verdict::consistent);
      tally.by_both += torque.front().count(Verdict::consistent);
    }
    const auto motion = commission::isolate_events(log, robot.model, first(*kinematic.detection));
    if (!motion.empty()) {
      ++tally.kinematic;
      holds(motion.front(), breakage.fault, magnitude, run.onset, what + "alarm of the kinematic residual");
      tally.left += motion.front().count(Verdict::consistent);
      is_the_same_of_some(log, robot.model, first(*kinematic.detection), motion.front());
      for (const FaultFinding& f : motion.front().findings) {
        EXPECT_FALSE(f.verdict == Verdict::consistent && f.fault.name.starts_with("effort_"))
            << what << f.fault.name << " does not move a robot beside its wheels";
      }
    }
    const std::vector<Incident> incidents = commission::join_events(log, robot.model, detection, torque, kinematic);
    if (!incidents.empty()) {
      tally.incidents.push_back(incidents.size());
      EXPECT_TRUE(incidents.front().stays) << what;
    }
    ASSERT_FALSE(::testing::Test::HasFatalFailure());
  }
}

class OdometryIsolation : public ::testing::TestWithParam<bool> {};

TEST_P(OdometryIsolation, KeepsTheTrueFaultAndLeavesFewerThanTheTorqueAlone) {
  Tally tally;
  try_runs(GetParam() ? 1 : 2, GetParam(), tally);
  ASSERT_FALSE(HasFatalFailure());
  RecordProperty("torque", tally.torque);
  RecordProperty("kinematic", tally.kinematic);
  RecordProperty("by_torque", static_cast<int>(tally.by_torque));
  RecordProperty("by_both", static_cast<int>(tally.by_both));
  RecordProperty("left", static_cast<int>(tally.left));
  EXPECT_GE(tally.torque, 4);
  EXPECT_GE(tally.kinematic, 4);
  EXPECT_LT(tally.by_both, tally.by_torque);
  std::ranges::sort(tally.incidents);
  EXPECT_EQ(tally.incidents[tally.incidents.size() / 2], 1U);
}

INSTANTIATE_TEST_SUITE_P(PoseAndHeading, OdometryIsolation, ::testing::Bool());

FaultFinding left(const std::string& name, Interval size, Interval onset, bool moves) {
  FaultFinding finding;
  finding.fault.name = name;
  if (moves) {
    finding.fault.motion = Eigen::Matrix2d::Identity();
  }
  finding.verdict = Verdict::consistent;
  finding.magnitude = size;
  finding.onset = onset;
  return finding;
}

TEST(BothResiduals, LeaveWhatBothLeave) {
  Isolation torque{
      .window = {},
      .findings = {left("meet", {0.1, 0.3}, {1.0, 2.0}, true), left("apart", {0.1, 0.2}, {1.0, 2.0}, true),
                   left("late", {0.1, 0.3}, {1.0, 2.0}, true), left("excluded", {0.1, 0.3}, {1.0, 2.0}, true),
                   left("open", {0.0, 0.0}, {0.0, 0.0}, true), left("untouched", {0.1, 0.3}, {1.0, 2.0}, false)}};
  torque.findings[4].verdict = Verdict::not_examined;
  Isolation kinematic{
      .window = {},
      .findings = {left("meet", {0.2, 0.5}, {1.5, 3.0}, true), left("apart", {0.3, 0.5}, {1.0, 2.0}, true),
                   left("late", {0.1, 0.3}, {2.5, 3.0}, true), left("excluded", {0.1, 0.3}, {1.0, 2.0}, true),
                   left("open", {0.2, 0.3}, {1.0, 2.0}, true), left("untouched", {0.1, 0.3}, {1.0, 2.0}, false)}};
  kinematic.findings[3].verdict = Verdict::excluded;
  kinematic.findings[5].verdict = Verdict::not_examined;
  narrow_by(torque, kinematic, 0.01);
  EXPECT_EQ(torque.findings[0].magnitude, (Interval{0.2, 0.3}));
  EXPECT_EQ(torque.findings[0].onset, (Interval{1.49, 2.0}));
  EXPECT_EQ(torque.findings[1].verdict, Verdict::excluded);
  EXPECT_EQ(torque.findings[2].verdict, Verdict::excluded);
  EXPECT_EQ(torque.findings[3].verdict, Verdict::excluded);
  EXPECT_EQ(torque.findings[4].verdict, Verdict::consistent);
  EXPECT_EQ(torque.findings[4].magnitude, (Interval{0.2, 0.3}));
  EXPECT_EQ(torque.findings[5].magnitude, (Interval{0.1, 0.3}));
}

}  // namespace
}  // namespace wheelwright::detector::odometry_isolation_test

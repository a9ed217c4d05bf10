// SPDX-License-Identifier: Apache-2.0
// One fault that stays is one incident, whatever rows are lost, and its kind, size and onset are never excluded by it.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "commission/watch/detector_walk.hpp"
#include "commission/watch/incident_watch.hpp"
#include "detector/online_model.hpp"
#include "tests/detector/detectability.hpp"

namespace wheelwright::detector::incident_runs_test {
namespace {

using testing_support::Breakage;
using testing_support::breakages;
using testing_support::Commissioned;
using testing_support::commissioned_robot;
using testing_support::FaultyRun;
using testing_support::log_of;
using testing_support::promise;
using testing_support::Random;
using testing_support::random_run;

// Rows lost at random, and stretches of `gap` s; gaps of more than five steps begin a segment, as on reading a file.
LogTable with_losses(const LogTable& whole, double share, const std::vector<double>& gaps, double gap,
                     std::uint64_t seed) {
  Random random(seed);
  LogTable log = whole;
  log.t.clear();
  for (auto& column : log.columns) {
    column.clear();
  }
  log.segment_starts.clear();
  const double step = whole.t[1] - whole.t[0];
  for (std::size_t k = 0; k < whole.rows(); ++k) {
    const bool lost = random.unit() < share || std::ranges::any_of(gaps, [&](double from) {
                        return whole.t[k] >= from && whole.t[k] < from + gap;
                      });
    if (lost) {
      continue;
    }
    if (!log.t.empty() && whole.t[k] - log.t.back() > 5.0 * step) {
      log.segment_starts.push_back(log.t.size());
    }
    log.t.push_back(whole.t[k]);
    for (std::size_t c = 0; c < log.columns.size(); ++c) {
      log.columns[c].push_back(whole.columns[c][k]);
    }
  }
  return log;
}

std::vector<Incident> incidents_of(const OnlineModel& m, const LogTable& table) {
  TableSource log(table);
  const Detection detection = detect(log, make_detector(m));
  const commission::KinematicWatch kinematic = commission::watch_kinematics(log, m, {});
  return commission::join_events(log, m, detection, commission::isolate_events(log, m, detection), kinematic);
}

struct Tally {
  std::vector<std::size_t> incidents;  // of each run
  std::size_t events = 0;

  [[nodiscard]] std::size_t at(double share) {
    std::ranges::sort(incidents);
    return incidents[static_cast<std::size_t>(share * static_cast<double>(incidents.size() - 1))];
  }
};

void try_runs(std::uint64_t robot_seed, double share, Tally& tally) {
  const Commissioned robot = commissioned_robot(robot_seed);
  for (std::size_t k = 0; k < breakages().size(); ++k) {
    const std::uint64_t seed = 1000 * robot_seed + k;
    const Breakage& breakage = breakages()[k];
    FaultyRun run = random_run(robot, seed, breakage);
    run.drive.duration = 24.0;
    const double size = 2.0 * promise(run, 0.0, 1.0, 1.0).certain;
    const double largest = run.side > 0.0 ? run.fault.range.upper : -run.fault.range.lower;
    if (!(size <= 0.8 * largest) || (breakage.fault.starts_with("effort_loss") && size > 0.5)) {
      continue;
    }
    const double magnitude = run.side * size;
    const std::vector<double> gaps = {run.onset + 4.0, run.onset + 12.0};
    const LogTable log = with_losses(log_of(run, magnitude, true), share, gaps, 10.0 / run.drive.rate, seed);
    const std::vector<Incident> incidents = incidents_of(robot.model, log);
    if (incidents.empty()) {
      continue;
    }
    const std::string what = breakage.fault + " of " + std::to_string(magnitude) + ", seed " + std::to_string(seed);
    tally.incidents.push_back(incidents.size());
    for (const Incident& incident : incidents) {
      tally.events += incident.events;
      EXPECT_TRUE(incident.stays) << what;
      const auto truth = std::ranges::find(incident.candidates, breakage.fault,
                                           [](const IncidentCandidate& c) { return c.finding.fault.name; });
      ASSERT_NE(truth, incident.candidates.end()) << what;
      EXPECT_FALSE(truth->changes) << what;
      EXPECT_TRUE(truth->finding.magnitude->contains(magnitude))
          << what << ": " << truth->finding.magnitude->lower << " to " << truth->finding.magnitude->upper;
      const Interval& onset = truth->finding.onset;
      EXPECT_TRUE(run.onset <= onset.upper && (truth->finding.earlier || run.onset >= onset.lower))
          << what << ", at " << run.onset << ": " << onset.lower << " to " << onset.upper;
    }
  }
}

class IncidentRuns : public ::testing::TestWithParam<double> {};

TEST_P(IncidentRuns, OneFaultIsOneIncidentWithTheTruthAmongItsCandidates) {
  Tally tally;
  try_runs(GetParam() == 0.05 ? 2 : 1, GetParam(), tally);
  ASSERT_FALSE(HasFatalFailure());
  ASSERT_GE(tally.incidents.size(), 4U);
  EXPECT_GT(tally.events, tally.incidents.size()) << "some have several events";
  RecordProperty("runs", static_cast<int>(tally.incidents.size()));
  RecordProperty("events", static_cast<int>(tally.events));
  RecordProperty("median", static_cast<int>(tally.at(0.5)));
  RecordProperty("most", static_cast<int>(tally.at(1.0)));
  EXPECT_EQ(tally.at(0.5), 1U);
  EXPECT_EQ(tally.at(0.95), 1U);
}

INSTANTIATE_TEST_SUITE_P(SharesOfRowsLost, IncidentRuns, ::testing::Values(0.0, 0.01, 0.05));

}  // namespace
}  // namespace wheelwright::detector::incident_runs_test

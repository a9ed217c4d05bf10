// SPDX-License-Identifier: Apache-2.0
// Drift: what is certain, what is a trend, and how often chance is taken for one.
#include "study/fleet_result.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "tests/study/fleets.hpp"

namespace wheelwright::study::drift_test {
namespace {

using testing_support::Random;

TEST(Drift, IsCertainWhereBoundsAreDisjoint) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const std::vector<DriftPoint> points = {
      {0.0, none, none, 1.0, 2.0}, {7.0, none, none, 1.8, 2.6}, {14.0, none, none, 2.5, 3.0}};
  const auto drift = drift_through(points, true);
  ASSERT_TRUE(drift);
  EXPECT_NEAR(drift->certain, 0.5, 1e-12);
  EXPECT_LE(drift->certain, 0.5) << "the least change, rounded inward";
  EXPECT_EQ(drift->certain_from, 0.0);
  EXPECT_EQ(drift->certain_to, 14.0);
  EXPECT_FALSE(drift->has_trend);
  EXPECT_TRUE(drift->drifts(0.05));
}

TEST(Drift, BoundsThatMeetSayNothing) {
  const double none = std::numeric_limits<double>::quiet_NaN();
  const std::vector<DriftPoint> touching = {{0.0, none, none, 1.0, 2.0}, {7.0, none, none, 2.0, 3.0}};
  EXPECT_EQ(drift_through(touching, true)->certain, 0.0);
  EXPECT_FALSE(drift_through(touching, true)->drifts(0.05));
  EXPECT_FALSE(drift_through(std::span(touching).first(1), true));
}

TEST(Drift, FallsAreCertainToo) {
  const std::vector<DriftPoint> points = {{0.0, 5.0, 0.1, 4.5, 5.5}, {7.0, 3.0, 0.1, 2.5, 3.5}};
  EXPECT_NEAR(drift_through(points, true)->certain, -1.0, 1e-12);
}

TEST(Drift, LineIsTheTextbookOne) {
  // Two points: slope is their difference a week, its variance the sum of theirs.
  const std::vector<DriftPoint> points = {{10.0, 5.0, 0.3, 0.0, 10.0}, {24.0, 6.0, 0.4, 0.0, 10.0}};
  const auto weeks = drift_through(points, true);
  EXPECT_NEAR(weeks->slope, 0.5, 1e-12);
  EXPECT_NEAR(weeks->slope_error, 0.25, 1e-12);
  EXPECT_EQ(weeks->freedom, 0.0);
  EXPECT_NEAR(drift_through(points, false)->slope, 1.0 / 14.0, 1e-12);
  // Three points on a line leave nothing over.
  const std::vector<DriftPoint> line = {{0.0, 1.0, 0.1, 0, 9}, {7.0, 2.0, 0.5, 0, 9}, {21.0, 4.0, 0.2, 0, 9}};
  EXPECT_NEAR(drift_through(line, true)->slope, 1.0, 1e-12);
  EXPECT_NEAR(drift_through(line, true)->chi_square, 0.0, 1e-20);
}

TEST(Drift, LogsOfOneDayMakeNoTrend) {
  const std::vector<DriftPoint> points = {{3.0, 5.0, 0.3, 0.0, 10.0}, {3.0, 6.0, 0.4, 0.0, 10.0}};
  EXPECT_FALSE(drift_through(points, true)->has_trend);
}

// A fleet whose robots stay as they are, but whose logs differ by `extra` beside their standard errors.
std::vector<ParameterDrift> still_fleet(std::size_t robots, std::size_t logs, double extra, Random& random) {
  std::vector<ParameterDrift> out;
  for (std::size_t i = 0; i < robots; ++i) {
    const double truth = 20.0 + random.normal();
    std::vector<DriftPoint> points;
    for (std::size_t k = 0; k < logs; ++k) {
      points.push_back(
          {7.0 * static_cast<double>(k), truth + 0.1 * random.normal() + extra * random.normal(), 0.1, 0.0, 50.0});
    }
    out.push_back(*drift_through(points, true));
    out.back().robot = i;
  }
  judge_drift(out);
  return out;
}

TEST(Drift, ChanceIsSeldomTakenForATrend) {
  struct Case {
    std::size_t robots, logs;
    double extra;
  };
  constexpr int fleets = 300;
  for (const Case& c :
       {Case{6, 2, 0.0}, Case{40, 2, 0.0}, Case{40, 2, 0.5}, Case{6, 4, 0.0}, Case{40, 3, 0.0}, Case{40, 4, 0.5}}) {
    Random random(c.robots * 10 + c.logs);
    int wrong = 0;
    for (int f = 0; f < fleets; ++f) {
      bool any = false;
      for (const ParameterDrift& d : still_fleet(c.robots, c.logs, c.extra, random)) {
        any = any || d.drifts(0.05);
      }
      wrong += any ? 1 : 0;
    }
    RecordProperty("fleets_with_false_drift_" + std::to_string(c.robots) + "_" + std::to_string(c.logs), wrong);
    EXPECT_LE(wrong, 0.05 * fleets + 4.0 * std::sqrt(0.05 * 0.95 * fleets))
        << c.robots << " robots, " << c.logs << " logs, " << c.extra;
  }
}

// Standard errors of few degrees of freedom are wrong by themselves: Student's law allows for it.
TEST(Drift, StandardErrorsThatAreThemselvesUncertainAreAllowedFor) {
  constexpr int fleets = 300;
  constexpr std::size_t freedom = 5;
  Random random(41);
  int wrong = 0;
  for (int f = 0; f < fleets; ++f) {
    std::vector<ParameterDrift> fleet;
    for (std::size_t i = 0; i < 30; ++i) {
      std::vector<DriftPoint> points;
      for (int k = 0; k < 2; ++k) {
        double sum = 0.0;
        for (std::size_t n = 0; n < freedom; ++n) {
          const double z = random.normal();
          sum += z * z;
        }
        points.push_back({7.0 * k, random.normal(), std::sqrt(sum / freedom), -50.0, 50.0, freedom});
      }
      fleet.push_back(*drift_through(points, true));
      EXPECT_GE(fleet.back().own_freedom, freedom);
      EXPECT_LE(fleet.back().own_freedom, 2.0 * freedom + 1e-9);
    }
    judge_drift(fleet);
    wrong += fleet[0].drifts(0.05) ? 1 : 0;
  }
  RecordProperty("fleets_with_false_drift_uncertain", wrong);
  EXPECT_LE(wrong, 0.05 * fleets + 4.0 * std::sqrt(0.05 * 0.95 * fleets));
}

TEST(Drift, TheRobotThatDriftsStandsFirst) {
  Random random(12);
  std::vector<ParameterDrift> fleet;
  for (std::size_t i = 0; i < 20; ++i) {
    std::vector<DriftPoint> points;
    for (int k = 0; k < 5; ++k) {
      const double truth = 20.0 + (i == 13 ? 0.4 * k : 0.0);
      points.push_back({7.0 * k, truth + 0.1 * random.normal(), 0.1, truth - 2.0, truth + 2.0});
    }
    fleet.push_back(*drift_through(points, true));
    fleet.back().robot = i;
  }
  judge_drift(fleet);
  EXPECT_EQ(fleet[0].robot, 13U);
  EXPECT_TRUE(fleet[0].drifts(0.05));
  EXPECT_FALSE(fleet[1].drifts(0.05));
  EXPECT_LT(fleet[0].lower, 0.4);
  EXPECT_GT(fleet[0].upper, 0.4);
  EXPECT_TRUE(repeats_known(fleet));
}

TEST(Drift, OfARecordGoesByParameter) {
  Random random(3);
  RobotRecord record = testing_support::drawn_record("r", {20.0, 1.0}, 0.1, random);
  record.commissioning.when = 0.0;
  CheckRecord later;
  later.log = testing_support::drawn_record("r", {30.0, 1.0}, 0.1, random).commissioning;
  later.log.when = 7.0;
  record.checks.push_back(later);
  record.dated = true;
  FleetTable table;
  add(table, record);
  const auto drift = drift_of(record, 0, table);
  ASSERT_EQ(drift.size(), 2U);
  EXPECT_GT(drift[0].certain, 9.0);
  EXPECT_EQ(table.columns[drift[0].column].name, "mass");
  EXPECT_EQ(drift[1].certain, 0.0);
}

}  // namespace
}  // namespace wheelwright::study::drift_test

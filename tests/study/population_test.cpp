// SPDX-License-Identifier: Apache-2.0
// Robots outside: few in fleets that are alike, all of those that are strange.
#include "study/population.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "study/fleet_result.hpp"
#include "tests/study/fleets.hpp"

namespace wheelwright::study::population_test {
namespace {

using testing_support::drawn_record;
using testing_support::Random;

// A fleet of n robots with p parameters, N(20, spread²), errors of `error` each.
FleetTable alike(std::size_t n, std::size_t p, double spread, double error, Random& random) {
  FleetTable table;
  for (std::size_t i = 0; i < n; ++i) {
    std::vector<double> truth(p);
    for (double& x : truth) {
      x = 20.0 + spread * random.normal();
    }
    // Errors differ between robots by a factor of four.
    add(table, drawn_record("robot_" + std::to_string(i), truth, error * (0.5 + 1.5 * random.unit()), random));
  }
  return table;
}

// The share of homogeneous fleets in which any robot is called outside is at most the stated level, small fleets and
// large, spread dominating or error dominating. 4 standard errors of the simulation are allowed for.
TEST(Population, CallsNobodyOutsideInFleetsThatAreAlike) {
  struct Case {
    std::size_t robots;
    double spread, error;
    int fleets;
  };
  for (const Case& c : {Case{5, 1.0, 0.3, 400}, Case{8, 1.0, 1.0, 400}, Case{20, 1.0, 0.1, 150},
                        Case{20, 0.0, 1.0, 150}, Case{60, 1.0, 0.5, 30}, Case{300, 1.0, 0.5, 100}}) {
    Random random(c.robots + static_cast<std::size_t>(100.0 * c.error));
    int wrong = 0, odd = 0;
    for (int k = 0; k < c.fleets; ++k) {
      const Population population = describe_population(alike(c.robots, 4, c.spread, c.error, random));
      wrong += population.outside.empty() ? 0 : 1;
      odd += population.outside.empty() && population.odd.empty() ? 0 : 1;
    }
    const auto allowed = [&](double level) {
      return level * c.fleets + 4.0 * std::sqrt(level * (1.0 - level) * c.fleets);
    };
    RecordProperty("fleets_with_false_flags_" + std::to_string(c.robots), wrong);
    EXPECT_LE(wrong, allowed(0.05)) << c.robots << " robots, spread " << c.spread << ", error " << c.error;
    EXPECT_LE(odd, allowed(0.2)) << c.robots << " robots, spread " << c.spread << ", error " << c.error;
  }
}

TEST(Population, FindsStrangersThatWouldHideOneAnother) {
  Random random(4);
  FleetTable table = alike(30, 2, 1.0, 0.1, random);
  for (int k = 0; k < 3; ++k) {
    add(table, drawn_record("strange_" + std::to_string(k), {40.0 + k, 20.0}, 0.1, random));
  }
  const Population population = describe_population(table);
  ASSERT_EQ(population.outside.size(), 3U);
  for (const RobotOutside& robot : population.outside) {
    EXPECT_TRUE(table.robots[robot.robot].starts_with("strange"));
    EXPECT_EQ(table.columns[robot.column].name, "mass");
    EXPECT_GT(robot.deviations, 5.0);
    EXPECT_TRUE(robot.certain) << "its bounds lie above those of all that are alike";
    EXPECT_EQ(robot.certainly_beyond, 1.0);
    EXPECT_LE(robot.adjusted_p, 0.05);
  }
  EXPECT_EQ(population.tests, 66U);
}

// Five others hardly tell their own spread, so that ten times it is not beyond all chance. It is named all the same.
TEST(Population, OfSixRobotsTheOneTenSpreadsAwayIsTheFirstThatIsNamed) {
  Random random(4);
  int named = 0, outside = 0;
  for (int k = 0; k < 100; ++k) {
    FleetResult fleet;
    for (int i = 0; i < 6; ++i) {
      take(fleet, drawn_record("robot_" + std::to_string(i),
                               {i == 3 ? 30.0 : 20.0 + random.normal(), 20.0 + random.normal()}, 0.2, random));
    }
    judge_fleet(fleet);
    outside += fleet.population.outside.empty() ? 0 : 1;
    const std::string first = sentences(fleet).front();
    named +=
        first.starts_with("Look at robot_3: mass ") && first.find(" % above the others") != std::string::npos ? 1 : 0;
  }
  EXPECT_GE(named, 80);
  EXPECT_LT(outside, named) << "the test would show nothing";
}

TEST(Population, AStrangerWithWideBoundsIsNotCertain) {
  Random random(8);
  FleetTable table = alike(40, 1, 1.0, 0.1, random);
  RobotRecord strange = drawn_record("strange", {40.0}, 0.1, random);
  strange.commissioning.parameters[0].lower = 10.0;
  add(table, strange);
  const Population population = describe_population(table);
  ASSERT_EQ(population.outside.size(), 1U);
  EXPECT_FALSE(population.outside[0].certain);
}

TEST(Population, AnUncertainRobotIsNotOutside) {
  Random random(8);
  FleetTable table = alike(40, 1, 1.0, 0.1, random);
  RobotRecord far = drawn_record("far", {40.0}, 0.1, random);
  far.commissioning.parameters[0].standard_error = 15.0;
  add(table, far);
  EXPECT_TRUE(describe_population(table).outside.empty());
}

TEST(Population, TheCentralRangeHoldsTheMiddleOfTheTruth) {
  Random random(21);
  FleetTable table;
  std::vector<double> truths;
  for (int i = 0; i < 200; ++i) {
    truths.push_back(20.0 + random.normal());
    add(table, drawn_record(std::to_string(i), {truths.back()}, 0.3, random));
  }
  const Interval central = describe_population(table).parameters[0].central;
  std::sort(truths.begin(), truths.end());
  EXPECT_LE(central.lower, truths[10]);
  EXPECT_GE(central.upper, truths[189]);
}

TEST(Population, LooksAtNoParameterThatFewShow) {
  Random random(2);
  FleetTable table = alike(4, 1, 1.0, 0.1, random);
  const Population few = describe_population(table);
  EXPECT_FALSE(few.parameters[0].described);
  EXPECT_EQ(few.tests, 0U);
  RobotRecord blind = drawn_record("blind", {20.0}, 0.1, random);
  blind.commissioning.parameters[0].estimate.reset();
  add(table, blind);
  EXPECT_EQ(describe_population(table).parameters[0].shown, 4U) << "a parameter that a log does not show";
}

TEST(Population, DoesNotDependOnTheOrderOfRobots) {
  Random random(9);
  std::vector<RobotRecord> records;
  for (int i = 0; i < 30; ++i) {
    records.push_back(drawn_record(std::to_string(i), {i == 7 ? 60.0 : 20.0 + random.normal()}, 0.2, random));
  }
  FleetTable there, back;
  for (std::size_t i = 0; i < records.size(); ++i) {
    add(there, records[i]);
    add(back, records[records.size() - 1 - i]);
  }
  const Population a = describe_population(there), b = describe_population(back);
  ASSERT_EQ(a.outside.size(), 1U);
  ASSERT_EQ(b.outside.size(), 1U);
  EXPECT_EQ(there.robots[a.outside[0].robot], "7");
  EXPECT_EQ(back.robots[b.outside[0].robot], "7");
}

TEST(Population, RefusesOptionsThatMakeNoSense) {
  EXPECT_THROW((void)describe_population({}, {.level = 0.0}), InvalidArgument);
  EXPECT_THROW((void)describe_population({}, {.fewest = 2}), InvalidArgument);
  EXPECT_THROW((void)describe_population({}, {.central = 1.0}), InvalidArgument);
  EXPECT_TRUE(describe_population({}).parameters.empty());
}

}  // namespace
}  // namespace wheelwright::study::population_test

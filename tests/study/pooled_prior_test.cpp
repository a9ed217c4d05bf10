// SPDX-License-Identifier: Apache-2.0
// The pooled prior covers what it says, whatever the fleet is like, and says so where it cannot.
#include "study/population.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/error.hpp"
#include "tests/study/fleets.hpp"

namespace wheelwright::study::pooled_prior_test {
namespace {

using testing_support::drawn_record;
using testing_support::Random;

// θ's that are skewed, coupled and, one in ten, far away: nothing that a normal box would cover.
std::vector<double> strange_truth(Random& random) {
  const double common = random.normal();
  const double far = random.unit() < 0.1 ? 30.0 : 1.0;
  return {20.0 + std::exp(0.8 * random.normal()) * far, 1.0 + 0.2 * common + 0.1 * random.laplace(),
          4.0 + common * common};
}

FleetTable strange_fleet(std::size_t n, Random& random) {
  FleetTable table;
  for (std::size_t i = 0; i < n; ++i) {
    add(table, drawn_record("robot_" + std::to_string(i), strange_truth(random), 0.02, random));
  }
  return table;
}

bool holds(const PooledPrior& prior, const std::vector<double>& truth) {
  for (std::size_t j = 0; j < truth.size(); ++j) {
    if (prior.parameters[j].included && !prior.parameters[j].box.contains(truth[j])) {
      return false;
    }
  }
  return true;
}

// Over fleets and next robots the box holds the next robot's θ as often as is stated, within the binomial error of the
// simulation, and not much more often: bounds are narrow here.
TEST(PooledPrior, CoversTheNextRobotAsStated) {
  Random random(77);
  constexpr int fleets = 1500;
  int held = 0;
  double stated = 0.0;
  for (int k = 0; k < fleets; ++k) {
    const PooledPrior prior = pooled_prior(strange_fleet(60, random), {.coverage = 0.9, .seed = 5});
    ASSERT_TRUE(prior.exists) << prior.message;
    stated = prior.coverage;
    held += holds(prior, strange_truth(random)) ? 1 : 0;
  }
  EXPECT_EQ(stated, 28.0 / 31.0);
  const double error = std::sqrt(stated * (1.0 - stated) / fleets);
  const double share = static_cast<double>(held) / fleets;
  RecordProperty("covered_permille", static_cast<int>(1000.0 * share));
  EXPECT_GE(share, stated - 3.0 * error);
  EXPECT_LE(share, stated + 1.0 / 31.0 + 5.0 * error);
}

// Robots that show less, and robots that gave nothing, cost width and not coverage.
TEST(PooledPrior, CoversWhereRobotsShowLittle) {
  Random random(31);
  constexpr int fleets = 600;
  int held = 0, boxes = 0;
  for (int k = 0; k < fleets; ++k) {
    FleetTable table;
    for (std::size_t i = 0; i < 80; ++i) {
      RobotRecord record = drawn_record("robot_" + std::to_string(i), strange_truth(random), 0.02, random);
      if (random.unit() < 0.03) {
        record.commissioning.parameters[0].lower = -1e4;
        record.commissioning.parameters[0].upper = 1e4;
      }
      if (random.unit() < 0.02) {
        record.commissioning = {};
        record.commissioning.status = RobotStatus::contradicted;
      }
      add(table, record);
    }
    const PooledPrior prior = pooled_prior(table, {.coverage = 0.9, .seed = 5});
    boxes += prior.exists ? 1 : 0;
    held += !prior.exists || holds(prior, strange_truth(random)) ? 1 : 0;
  }
  EXPECT_GT(boxes, fleets / 2);
  EXPECT_GE(static_cast<double>(held) / fleets, 0.9 - 3.0 * std::sqrt(0.09 / fleets));
}

TEST(PooledPrior, BoxIsThePoints) {
  // 2·19 robots, the fewest for 95 %: the box holds the bounds of every scored robot.
  Random random(6);
  const FleetTable table = strange_fleet(38, random);
  const PooledPrior prior = pooled_prior(table);
  ASSERT_TRUE(prior.exists);
  EXPECT_EQ(prior.needed, 38U);
  EXPECT_EQ(prior.scored, 19U);
  EXPECT_EQ(prior.rank, 19U);
  EXPECT_EQ(prior.coverage, 0.95);
  std::size_t inside = 0;
  for (std::size_t i = 0; i < 38; ++i) {
    bool all = true;
    for (const PooledParameter& p : prior.parameters) {
      const FleetEntry& e = table.columns[p.column].entries[i];
      all = all && p.box.lower <= e.lower && e.upper <= p.box.upper;
    }
    inside += all ? 1 : 0;
  }
  EXPECT_GE(inside, 19U);
}

TEST(PooledPrior, TooFewRobotsAreToldHowManyAreNeeded) {
  Random random(6);
  const PooledPrior prior = pooled_prior(strange_fleet(37, random));
  EXPECT_FALSE(prior.exists);
  EXPECT_NE(prior.message.find("38 are needed"), std::string::npos) << prior.message;
  EXPECT_EQ(prior.parameters[0].box, prior.parameters[0].before);
  EXPECT_EQ(pooled_prior(strange_fleet(18, random), {.coverage = 0.9}).exists, true);
  EXPECT_EQ(pooled_prior({}).exists, false);
}

TEST(PooledPrior, DoesNotDependOnTheOrderOfRobots) {
  Random random(14);
  std::vector<RobotRecord> records;
  for (int i = 0; i < 50; ++i) {
    records.push_back(drawn_record("robot_" + std::to_string(i), strange_truth(random), 0.02, random));
  }
  FleetTable there, back;
  for (std::size_t i = 0; i < records.size(); ++i) {
    add(there, records[i]);
    add(back, records[records.size() - 1 - i]);
  }
  const PooledPrior a = pooled_prior(there), b = pooled_prior(back), other = pooled_prior(there, {.seed = 2});
  for (std::size_t j = 0; j < a.parameters.size(); ++j) {
    EXPECT_EQ(a.parameters[j].box, b.parameters[j].box);
  }
  EXPECT_NE(a.radius, other.radius) << "another split";
}

TEST(PooledPrior, LeavesOutWhatTooManyDoNotShow) {
  Random random(2);
  FleetTable table;
  for (std::size_t i = 0; i < 60; ++i) {
    RobotRecord record = drawn_record("robot_" + std::to_string(i), strange_truth(random), 0.02, random);
    if (i % 2 == 0) {
      record.commissioning.parameters[2].lower = -1e4;
      record.commissioning.parameters[2].upper = 1e4;
    }
    add(table, record);
  }
  const PooledPrior prior = pooled_prior(table);
  ASSERT_TRUE(prior.exists);
  EXPECT_TRUE(prior.parameters[0].included);
  EXPECT_FALSE(prior.parameters[2].included);
  EXPECT_NE(prior.parameters[2].reason, "");
  EXPECT_EQ(prior.parameters[2].box, (Interval{-1e4, 1e4}));
}

TEST(PooledPrior, ManyRobotsWithoutBoundsLeaveNoBox) {
  Random random(2);
  FleetTable table = strange_fleet(60, random);
  for (std::size_t i = 0; i < 12; ++i) {
    RobotRecord record{.robot = "lost_" + std::to_string(i), .dated = false, .commissioning = {}};
    record.commissioning.status = RobotStatus::contradicted;
    add(table, record);
  }
  const PooledPrior prior = pooled_prior(table);
  EXPECT_FALSE(prior.exists);
  EXPECT_GT(prior.boundless, 0U);
  EXPECT_NE(prior.message.find("gave no bounds"), std::string::npos) << prior.message;
  // Logs that could not be read take no part.
  FleetTable readable = strange_fleet(60, random);
  const PooledPrior before = pooled_prior(readable);
  add(readable, {.robot = "lost", .dated = false, .commissioning = {}});
  EXPECT_EQ(pooled_prior(readable).radius, before.radius);
}

TEST(PooledPrior, RefusesOptionsThatMakeNoSense) {
  EXPECT_THROW((void)pooled_prior({}, {.coverage = 1.0}), InvalidArgument);
  EXPECT_THROW((void)pooled_prior({}, {.most_hidden = 1.5}), InvalidArgument);
}

}  // namespace
}  // namespace wheelwright::study::pooled_prior_test

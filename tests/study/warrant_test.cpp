// SPDX-License-Identifier: Apache-2.0
// A fleet's column stands on what the weakest of its logs stands on.
#include <gtest/gtest.h>

#include "study/population.hpp"

namespace wheelwright::study::fleet_warrant_test {

using core::Warrant;

namespace {

RobotRecord record_with(Warrant warrant) {
  RobotRecord record{.robot = "a", .dated = false, .commissioning = {}};
  record.commissioning.parameters = {{.name = "mass", .unit = "kg", .lower = 1.0, .upper = 2.0, .warrant = warrant}};
  return record;
}

TEST(FleetWarrants, AColumnHasTheWeakestOfItsRobots) {
  FleetTable table;
  add(table, record_with(Warrant::guaranteed));
  EXPECT_EQ(table.columns.front().warrant, Warrant::guaranteed);
  add(table, record_with(Warrant::statistical));
  EXPECT_EQ(table.columns.front().warrant, Warrant::statistical);
  add(table, record_with(Warrant::extrapolated));
  add(table, record_with(Warrant::guaranteed));
  EXPECT_EQ(table.columns.front().warrant, Warrant::extrapolated);
}

}  // namespace
}  // namespace wheelwright::study::fleet_warrant_test

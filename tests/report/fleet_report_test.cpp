// SPDX-License-Identifier: Apache-2.0
// The page of a fleet: small, escaped, and there for any fleet.
#include "results/report/fleet_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/study/fleets.hpp"

namespace wheelwright::report::fleet_report_test {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using testing_support::drawn_record;
using testing_support::Random;

study::FleetResult fleet_of(std::size_t robots, std::size_t checks, Random& random) {
  study::FleetResult fleet;
  for (std::size_t i = 0; i < robots; ++i) {
    const std::vector<double> truth = {20.0 + random.normal(), 1.0 + 0.1 * random.normal(), 4.0, 0.5};
    study::RobotRecord record = drawn_record("robot_" + std::to_string(i), truth, 0.05, random);
    record.dated = true;
    record.outputs = {{.name = "sum", .unit = "N·m", .median_width = 0.1 + random.unit(), .instants = 10}};
    record.smallest_radius_change = 0.04;
    for (std::size_t k = 1; k <= checks; ++k) {
      study::CheckRecord check;
      check.log = drawn_record("", truth, 0.05, random).commissioning;
      check.log.when = 7.0 * static_cast<double>(k);
      check.checked = true;
      record.checks.push_back(check);
    }
    study::take(fleet, record);
  }
  return fleet;
}

TEST(FleetReport, StaysSmallForThousandsOfRobots) {
  Random random(3);
  study::FleetResult fleet = fleet_of(3000, 2, random);
  study::judge_fleet(fleet);
  const std::string page = fleet_report(fleet, {});
  EXPECT_LT(page.size(), std::size_t{1} << 20);
  EXPECT_THAT(page, HasSubstr("3000 of 3000 robots were commissioned"));
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_THAT(page, Not(HasSubstr("nan")));
  study::FleetResult few = fleet_of(300, 2, random);
  study::judge_fleet(few);
  EXPECT_LT(page.size(), 2 * fleet_report(few, {}).size()) << "drawings do not grow with the fleet";
}

TEST(FleetReport, EscapesNames) {
  Random random(3);
  study::FleetResult fleet = fleet_of(30, 0, random);
  study::take(fleet, drawn_record("<script>alert(1)</script>", {90.0, 1.0, 4.0, 0.5}, 0.05, random));
  study::RobotRecord lost{.robot = "lost & gone", .dated = false, .commissioning = {}};
  lost.commissioning.message = "<b>no such file</b>";
  study::take(fleet, lost);
  study::judge_fleet(fleet);
  ASSERT_EQ(fleet.robots_outside(), 1U);
  const std::string page = fleet_report(fleet, {});
  EXPECT_THAT(page, Not(HasSubstr("<script>alert(1)")));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;alert(1)"));
  EXPECT_THAT(page, HasSubstr("lost &amp; gone"));
  EXPECT_THAT(page, HasSubstr("&lt;b&gt;no such file"));
}

TEST(FleetReport, IsThereForAFleetThatGaveNothing) {
  study::FleetResult fleet;
  study::take(fleet, {.robot = "lost", .dated = false, .commissioning = {}});
  study::judge_fleet(fleet);
  EXPECT_FALSE(fleet.well());
  EXPECT_THAT(fleet_report(fleet, {}), HasSubstr("0 of 1 robot were commissioned"));
}

}  // namespace
}  // namespace wheelwright::report::fleet_report_test

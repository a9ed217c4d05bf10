// SPDX-License-Identifier: Apache-2.0
// Records of robots come back as they were, to the last bit.
#include "results/fleet_json.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "formats/robots/robot_file.hpp"
#include "tests/study/fleets.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::results::fleet_json_test {
namespace {

using testing_support::drawn_record;
using testing_support::Random;

study::RobotRecord full_record() {
  Random random(3);
  study::RobotRecord record = drawn_record("a \"b\", c\nµ", {1.0 / 3.0, 1e-300}, 0.1, random);
  record.dated = true;
  record.commissioning.log = "x.csv";
  record.commissioning.message = "all well";
  record.commissioning.when = 20000.25;
  record.commissioning.parameters[1].estimate.reset();
  record.commissioning.parameters[1].standard_error.reset();
  record.commissioning.parameters[1].lower = std::nextafter(1.0, 2.0);
  record.commissioning.parameters[1].upper_is_prior = true;
  record.commissioning.parameters[0].warrant = core::Warrant::guaranteed;
  record.commissioning.parameters[0].freedom = 6.5;
  record.outputs = {{.name = "sum", .unit = "N·m", .median_width = 0.1, .instants = 7, .false_alarms = 1}};
  record.smallest_radius_change = 0.04;
  study::CheckRecord check;
  check.log = record.commissioning;
  check.log.status = study::RobotStatus::contradicted;
  check.checked = true;
  check.events = 2;
  check.first = 1.5;
  check.instants = 100;
  check.outside_share = 0.02;
  study::CheckRecord lost;
  lost.not_checked = "no such file";
  record.checks = {check, lost};
  record.notes = {"a note"};
  record.findings = {"listed twice"};
  record.passing = true;
  return record;
}

TEST(FleetJson, RecordsComeBackExactly) {
  const study::RobotRecord record = full_record();
  const std::string text = record_text(record);
  EXPECT_EQ(text.find('\n'), std::string::npos) << "one line";
  EXPECT_EQ(record_from_text(text, "here"), record);
  EXPECT_EQ(record_text(record_from_text(text, "here")), text);
}

TEST(FleetJson, APassingRecordIsKnownWithoutReadingIt) {
  study::RobotRecord record = full_record();
  EXPECT_TRUE(is_passing(record_text(record)));
  record.passing = false;
  record.robot = R"("passing":true)";
  record.notes = {R"({"passing":true})"};
  EXPECT_FALSE(is_passing(record_text(record)));
}

TEST(FleetJson, AnythingElseIsAnError) {
  EXPECT_NE(testing::input_error([] { (void)record_from_text("{}", "store: item 3"); }).find("store: item 3"),
            std::string::npos);
  Json json = Json::parse(record_text(full_record()));
  json["commissioning"]["status"] = "asleep";
  EXPECT_NE(testing::input_error([&] { (void)record_from_text(json.dump(), "here"); }).find("commissioned, partial"),
            std::string::npos);
}

TEST(FleetJson, CsvHasARowForEachParameter) {
  const std::string rows = fleet_csv_rows(full_record());
  EXPECT_EQ(std::count(rows.begin(), rows.end(), '\n'), 2 + 2) << "the name has a line end of its own, in quotes";
  EXPECT_NE(rows.find("\"a \"\"b\"\", c\nµ\",commissioned,mass,kg,"), std::string::npos) << rows;
  study::RobotRecord formula = full_record();
  formula.robot = "=1+1";
  EXPECT_EQ(fleet_csv_rows(formula).substr(0, 6), "'=1+1,");
  study::RobotRecord empty{.robot = "lost", .dated = false, .commissioning = {}};
  EXPECT_EQ(fleet_csv_rows(empty), "lost,unreadable,,,,,,,,,\n");
  const auto commas = [](const std::string& text) { return std::count(text.begin(), text.end(), ','); };
  EXPECT_EQ(commas(fleet_csv_rows(empty)), commas(fleet_csv_header()));
}

TEST(PooledPriorFile, IsThePriorOfARobotFile) {
  Random random(5);
  study::FleetResult fleet;
  for (int i = 0; i < 40; ++i) {
    study::RobotRecord record =
        drawn_record("robot_" + std::to_string(i), {20.0 + random.normal(), 1.0, 4.0, 0.5}, 0.01, random);
    for (study::RecordedParameter& p : record.commissioning.parameters) {
      p.prior = {0.0, 1e4};
    }
    study::take(fleet, record);
  }
  study::judge_fleet(fleet);
  ASSERT_TRUE(fleet.prior.exists);
  const std::string text = pooled_prior_yaml(fleet, "wheelwright 0");
  EXPECT_NE(text.find("at least 95"), std::string::npos) << text;
  const Robot robot =
      robots::parse_robot("model: differential_drive\nwheel_radius: 0.1\ntrack_width: 0.4\n" + text, "robot.yaml");
  ASSERT_EQ(robot.prior.size(), 4U);
  for (const study::PooledParameter& p : fleet.prior.parameters) {
    EXPECT_EQ(robot.prior.at(fleet.table.columns[p.column].name), p.box);
  }
}

TEST(PooledPriorFile, SaysWhyThereIsNone) {
  study::FleetResult fleet;
  study::judge_fleet(fleet);
  const std::string text = pooled_prior_yaml(fleet, "wheelwright 0");
  EXPECT_NE(text.find("too few"), std::string::npos) << text;
  EXPECT_NE(text.find("prior: {}"), std::string::npos) << text;
}

}  // namespace
}  // namespace wheelwright::results::fleet_json_test

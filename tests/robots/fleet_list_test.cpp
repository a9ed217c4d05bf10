// SPDX-License-Identifier: Apache-2.0
// Lists and directories of robots: roles, dates, order, and what is wrong with them.
#include "formats/robots/fleet_list.hpp"

#include <gtest/gtest.h>

#include "tests/support/scratch.hpp"

namespace wheelwright::robots::fleet_list_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::input_error;

class FleetList : public testing::ScratchTest {
 protected:
  std::vector<FleetListRobot> list(const std::string& text) const { return read_fleet(put("fleet.csv", text)); }
  std::string error(const std::string& text) const {
    return input_error([&] { (void)list(text); });
  }
  void logs(const std::vector<std::string>& names) const {
    for (const std::string& name : names) {
      std::filesystem::create_directories(path(name).parent_path());
      put(name, "t,omega_r\n");
    }
  }
  static std::vector<std::string> names(const std::vector<FleetListLog>& logs) {
    std::vector<std::string> out;
    for (const FleetListLog& log : logs) {
      out.push_back(log.path.filename().string());
    }
    return out;
  }
};

TEST(FleetDates, AreDaysOfTheCalendar) {
  EXPECT_EQ(days_of_date("1970-01-01"), 0.0);
  EXPECT_EQ(days_of_date("2000-03-01"), 11017.0);  // date -d 2000-03-01 +%s, over 86400
  EXPECT_EQ(days_of_date("20000301"), 11017.0);
  EXPECT_FALSE(days_of_date("2001-02-29"));
  EXPECT_FALSE(days_of_date("2001-13-01"));
  EXPECT_FALSE(days_of_date("12"));
  EXPECT_FALSE(days_of_date("2001/02/03"));
}

TEST_F(FleetList, TheEarliestLogCommissions) {
  logs({"a.csv", "b.csv", "c.csv"});
  const auto fleet = list("robot,log,when\namy,b.csv,2026-03-08\namy,a.csv,2026-03-01\nbob,c.csv,3.5\n");
  ASSERT_EQ(fleet.size(), 2U);
  EXPECT_EQ(fleet[0].name, "amy");
  EXPECT_TRUE(fleet[0].dated);
  EXPECT_THAT(names(fleet[0].commission), ElementsAre("a.csv"));
  EXPECT_THAT(names(fleet[0].checks), ElementsAre("b.csv"));
  EXPECT_EQ(fleet[0].checks[0].when - fleet[0].commission[0].when, 7.0);
  EXPECT_EQ(fleet[1].commission[0].when, 3.5);
  EXPECT_TRUE(fleet[0].findings.empty());
}

TEST_F(FleetList, RolesStandAboveDates) {
  logs({"a.csv", "b.csv", "c.csv"});
  const auto fleet = list("# a fleet\nlog,robot,role\na.csv,amy,check\nb.csv,amy,commission\nc.csv,amy,commission\n");
  ASSERT_EQ(fleet.size(), 1U);
  EXPECT_FALSE(fleet[0].dated);
  EXPECT_THAT(names(fleet[0].commission), ElementsAre("b.csv", "c.csv"));
  EXPECT_THAT(names(fleet[0].checks), ElementsAre("a.csv"));
}

TEST_F(FleetList, WhatIsWrongWithARobotIsAFinding) {
  logs({"a.csv", "b.csv"});
  const auto fleet = list(
      "robot,log,when,robot_file,role\namy,a.csv,1,x.yaml,\namy,./a.csv,2,,\namy,b.csv,,y.yaml,\nbob,gone.csv,1,,\n"
      "cy,a.csv,,,check\n");
  ASSERT_EQ(fleet.size(), 3U);
  EXPECT_THAT(fleet[0].findings,
              ElementsAre(HasSubstr("line 3: "), HasSubstr("line 4: robot_file"), HasSubstr("no date")));
  EXPECT_THAT(fleet[0].findings[0], HasSubstr("listed twice"));
  EXPECT_THAT(fleet[1].findings, ElementsAre(HasSubstr("no such file")));
  EXPECT_EQ(fleet[1].commission.size(), 1U);
  EXPECT_THAT(fleet[2].findings, ElementsAre(HasSubstr("no log to commission with")));
}

TEST_F(FleetList, QuotesHoldCommas) {
  const auto fleet = list("robot,log\n\"amy, \"\"the\"\" first\",\"a,b.csv\"\r\n");
  EXPECT_EQ(fleet[0].name, "amy, \"the\" first");
  EXPECT_EQ(fleet[0].commission[0].path.filename(), "a,b.csv");
}

TEST_F(FleetList, ErrorsNameTheLine) {
  EXPECT_THAT(error("# nothing\n"), HasSubstr("expected a header"));
  EXPECT_THAT(error("robot,log\n"), HasSubstr("no robot listed"));
  EXPECT_THAT(error("robot,logs\n"), HasSubstr("fleet.csv:1: unknown column 'logs'"));
  EXPECT_THAT(error("robot,logs\n"), HasSubstr("did you mean 'log'"));
  EXPECT_THAT(error("robot,when\n"), HasSubstr("log is missing"));
  EXPECT_THAT(error("root:x:0:0:root:/root:/bin/sh\n"), ::testing::Not(HasSubstr("root:x")));
  EXPECT_THAT(error("robot,log,log\n"), HasSubstr("stands twice"));
  EXPECT_THAT(error("robot,log\n\namy\n"), HasSubstr("fleet.csv:3: 1 fields: expected 2"));
  EXPECT_THAT(error("robot,log\n,a.csv\n"), HasSubstr("fleet.csv:2: robot is empty"));
  EXPECT_THAT(error("robot,log,when\namy,a.csv,2026-02-30\n"), HasSubstr("fleet.csv:2: when: '2026-02-30'"));
  EXPECT_THAT(error("robot,log,role\namy,a.csv,chek\n"), HasSubstr("did you mean 'check'"));
  EXPECT_THAT(error("robot,log\namy,\"a.csv\n"), HasSubstr("not closed"));
}

TEST_F(FleetList, ADirectoryHoldsRobots) {
  logs({"fleet/amy/run_10.csv", "fleet/amy/run_2.csv", "fleet/bob/2026-03-08.mcap", "fleet/bob/drive_20260301.csv.gz",
        "fleet/cy.csv", "fleet/notes.txt", "fleet/empty/readme.md", "fleet/.hidden/a.csv", "fleet/dora/metadata.yaml"});
  put("fleet/amy/robot.yaml", "model: single_axis\n");
  const auto fleet = read_fleet(path("fleet"));
  ASSERT_EQ(fleet.size(), 5U);
  EXPECT_EQ(fleet[0].name, "amy");
  EXPECT_THAT(names(fleet[0].commission), ElementsAre("run_2.csv"));
  EXPECT_THAT(names(fleet[0].checks), ElementsAre("run_10.csv"));
  EXPECT_FALSE(fleet[0].dated);
  EXPECT_EQ(fleet[0].robot_file.filename(), "robot.yaml");
  EXPECT_THAT(names(fleet[1].commission), ElementsAre("drive_20260301.csv.gz"));
  EXPECT_TRUE(fleet[1].dated);
  EXPECT_EQ(fleet[2].name, "cy.csv");
  EXPECT_EQ(fleet[3].name, "dora") << "a bag is a log";
  EXPECT_EQ(fleet[4].name, "empty");
  EXPECT_THAT(fleet[4].findings, ElementsAre(HasSubstr("no log to commission with")));
  std::filesystem::create_directories(path("nothing"));
  EXPECT_THAT(input_error([&] { (void)read_fleet(path("nothing")); }), HasSubstr("expected a robot"));
}

TEST_F(FleetList, AKeyIsAnotherWhereALogChanged) {
  logs({"a.csv"});
  const std::string text = "robot,log,when\namy,a.csv,1\n";
  const std::string before = key_of(list(text)[0]);
  EXPECT_EQ(before, key_of(list(text)[0]));
  EXPECT_TRUE(before.starts_with("amy"));
  EXPECT_NE(before, key_of(list("robot,log,when\namy,a.csv,2\n")[0]));
  put("a.csv", "t,omega_r\n0,1\n");
  EXPECT_NE(before, key_of(list(text)[0]));
  std::filesystem::remove(path("a.csv"));
  EXPECT_NE(before, key_of(list(text)[0]));
}

TEST_F(FleetList, AnotherFileOfTheSameSizeAndTimeIsAnother) {
  logs({"a.csv", "b.csv"});
  put("robot.yaml", "model: differential_drive\n");
  const FleetListRobot amy = list("robot,log,robot_file\namy,a.csv,robot.yaml\namy,b.csv,robot.yaml\n")[0];
  const std::vector<FileState> before = states_of(amy);
  ASSERT_EQ(before.size(), 3U);
  EXPECT_EQ(before[0].path, path("robot.yaml"));
  EXPECT_EQ(before[2].path, path("b.csv"));
  const std::string key = key_of(amy);
  const auto time = std::filesystem::last_write_time(path("b.csv"));
  std::filesystem::copy_file(path("b.csv"), path("other.csv"));
  std::filesystem::rename(path("other.csv"), path("b.csv"));
  std::filesystem::last_write_time(path("b.csv"), time);
  const std::vector<FileState> now = states_of(amy);
  EXPECT_EQ(key_of(amy), key);
  EXPECT_EQ(now[0].state, before[0].state);
  EXPECT_EQ(now[1].state, before[1].state);
  EXPECT_NE(now[2].state, before[2].state);
}

}  // namespace
}  // namespace wheelwright::robots::fleet_list_test

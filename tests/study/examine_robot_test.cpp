// SPDX-License-Identifier: Apache-2.0
// A robot's record: the truth inside, later logs compared, and bad logs that stop nothing.
#include "study/examine_robot.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "study/fleet_result.hpp"
#include "study/population.hpp"
#include "tests/study/simulated.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::study::examine_robot_test {
namespace {

using testing_support::broken;
using testing_support::driven;
using testing_support::noisy_drive;
using testing_support::Random;

const RecordedParameter& parameter(const LogRecord& log, const std::string& name) {
  const auto found = std::ranges::find(log.parameters, name, &RecordedParameter::name);
  if (found == log.parameters.end()) {
    throw std::runtime_error("no parameter " + name);
  }
  return *found;
}

TEST(ExamineRobot, RecordsTheTruth) {
  const RobotRecord record =
      examine_robot({.robot = "r1", .dated = true, .commissioning = driven(21.0, 1), .checks = {driven(21.0, 2, 7.0)}});
  EXPECT_EQ(record.robot, "r1");
  EXPECT_EQ(record.commissioning.status, RobotStatus::commissioned) << record.commissioning.message;
  const RecordedParameter& mass = parameter(record.commissioning, "mass");
  EXPECT_EQ(mass.unit, "kg");
  EXPECT_TRUE(mass.is_prior_key);
  EXPECT_LE(mass.lower, 21.0);
  EXPECT_GE(mass.upper, 21.0);
  ASSERT_TRUE(mass.estimate && mass.standard_error);
  EXPECT_NEAR(*mass.estimate, 21.0, 0.5);
  EXPECT_LE(mass.prior.lower, mass.lower);
  EXPECT_GE(mass.prior.upper, mass.upper);
  ASSERT_EQ(record.outputs.size(), 2U);
  EXPECT_GT(record.outputs[0].median_width, 0.0);
  EXPECT_EQ(record.outputs[0].false_alarms, 0U);
  ASSERT_TRUE(record.smallest_radius_change);
  EXPECT_GT(*record.smallest_radius_change, 0.0);
  ASSERT_EQ(record.checks.size(), 1U);
  EXPECT_TRUE(record.checks[0].checked);
  EXPECT_EQ(record.checks[0].events, 0U);
  EXPECT_EQ(record.checks[0].outside_share, 0.0);
  const RecordedParameter& again = parameter(record.checks[0].log, "mass");
  EXPECT_LE(again.lower, 21.0);
  EXPECT_GE(again.upper, 21.0);
  FleetTable table;
  add(table, record);
  for (const ParameterDrift& drift : drift_of(record, 0, table)) {
    EXPECT_EQ(drift.certain, 0.0) << table.columns[drift.column].name << ": nothing moved";
  }
}

TEST(ExamineRobot, TheSameLogsGiveTheSameRecord) {
  const RobotLogs logs{.robot = "r1", .commissioning = driven(21.0, 1), .checks = {driven(22.0, 2, 7.0)}};
  EXPECT_EQ(examine_robot(logs), examine_robot(logs));
}

TEST(ExamineRobot, AHeavierRobotRaisesAlarmsAndHasDrifted) {
  const RobotRecord record =
      examine_robot({.robot = "r1", .dated = true, .commissioning = driven(21.0, 1), .checks = {driven(30.0, 2, 7.0)}});
  ASSERT_TRUE(record.checks[0].checked) << record.checks[0].not_checked;
  EXPECT_GT(record.checks[0].events, 0U);
  EXPECT_TRUE(record.checks[0].first);
  EXPECT_GT(record.checks[0].outside_share, 0.0);
  FleetTable table;
  add(table, record);
  const auto drift = drift_of(record, 0, table);
  const auto mass = std::ranges::find_if(drift, [&](const auto& d) { return table.columns[d.column].name == "mass"; });
  ASSERT_NE(mass, drift.end());
  EXPECT_GT(mass->certain, 0.0);
  EXPECT_LE(mass->certain, 9.0) << "never more than what moved";
}

TEST(ExamineRobot, BadLogsAreFindings) {
  const RobotRecord lost = examine_robot({.robot = "r1",
                                          .commissioning = broken("no such file"),
                                          .checks = {driven(21.0, 2, 1.0), broken("cut off", 2.0)},
                                          .findings = {"listed twice"}});
  EXPECT_EQ(lost.commissioning.status, RobotStatus::unreadable);
  EXPECT_EQ(lost.commissioning.message, "no such file");
  EXPECT_EQ(lost.findings, std::vector<std::string>{"listed twice"});
  ASSERT_EQ(lost.checks.size(), 2U);
  EXPECT_FALSE(lost.checks[0].checked);
  EXPECT_NE(lost.checks[0].not_checked, "");
  EXPECT_EQ(lost.checks[0].log.status, RobotStatus::commissioned) << "its own commissioning stands";
  EXPECT_EQ(lost.checks[1].log.message, "cut off");
}

// "Later logs raised no alarm" is not said of logs of which nothing, or nearly nothing, was decided.
TEST(ExamineRobot, ALogThatIsNotDecidedIsNotChecked) {
  const Scenario scenario = noisy_drive(2);
  Simulation drive(scenario);
  const LogTable whole = read_all(drive);
  LogTable creeping = whole;  // a robot at rest, by a clock of 1 µs a row
  for (std::size_t k = 0; k < creeping.rows(); ++k) {
    creeping.t[k] = 1e-6 * static_cast<double>(k);
  }
  for (std::vector<double>& column : creeping.columns) {
    std::ranges::fill(column, 0.0);
  }
  const LogTable brief = core::slice(whole, 0, 1);
  const auto logged = [&](const LogTable& table, std::size_t met) {
    return FleetLog{.name = "check", .open = [&table, met, robot = scenario.robot] {
                      return OpenedLog{std::make_unique<TableSource>(table), robot, met};
                    }};
  };
  const RobotRecord record = examine_robot(
      {.robot = "r1",
       .commissioning = driven(scenario.parameters.mass, 1),
       .checks = {logged(whole, 0), logged(whole, 10 * whole.rows()), logged(creeping, 0), logged(brief, 0)}});
  ASSERT_EQ(record.checks.size(), 4U);
  EXPECT_TRUE(record.checks[0].checked) << record.checks[0].not_checked;
  EXPECT_EQ(record.checks[0].events, 0U);
  const std::vector<std::string> reasons = {"only", "hardly goes on", "no instant"};
  for (std::size_t i = 0; i < reasons.size(); ++i) {
    EXPECT_FALSE(record.checks[i + 1].checked) << reasons[i];
    EXPECT_NE(record.checks[i + 1].not_checked.find(reasons[i]), std::string::npos) << record.checks[i + 1].not_checked;
  }
}

TEST(ExamineRobot, AContradictionIsAStatus) {
  // One torque is wrong by ten times what is declared.
  const Scenario scenario = noisy_drive(4);
  Simulation drive(scenario);
  LogTable table = read_all(drive);
  for (double& torque : table.column("tau_r")) {
    torque += 10.0 * *scenario.robot.noise.effort.value;
  }
  const FleetLog log = {.name = "shifted", .open = [&] {
                          return OpenedLog{std::make_unique<TableSource>(table), scenario.robot};
                        }};
  const RobotRecord record = examine_robot({.robot = "r1", .commissioning = log});
  EXPECT_EQ(record.commissioning.status, RobotStatus::contradicted);
  EXPECT_TRUE(record.commissioning.parameters.empty());
}

// A box around the truth, such as a fleet gives, never widens what a short log says, and tightens it where the log is
// weak.
TEST(ExamineRobot, APriorOfTheFleetTightensTheNextRobot) {
  Random random(5);
  FleetTable table;
  for (std::uint64_t i = 0; i < 38; ++i) {
    const double mass = 20.0 + 0.2 * random.symmetric();
    FleetLog log = driven(mass, 100 + i);
    RobotRecord record = examine_robot({.robot = "robot_" + std::to_string(i), .commissioning = log});
    ASSERT_EQ(record.commissioning.status, RobotStatus::commissioned) << record.commissioning.message;
    add(table, record);
  }
  const PooledPrior prior = pooled_prior(table);
  ASSERT_TRUE(prior.exists) << prior.message;
  Scenario scenario = noisy_drive(999, 3.0);
  scenario.parameters.mass = 20.1;
  scenario.robot.effort_changes = model::EffortChanges::between;  // a weak log: when its commands change is not known
  Robot informed = scenario.robot;
  for (const PooledParameter& p : prior.parameters) {
    if (p.included) {
      informed.prior[table.columns[p.column].name] = p.box;
    }
  }
  Simulation alone_log(scenario), informed_log(scenario);
  const auto alone = recorded_parameters(commission_robot(alone_log, scenario.robot));
  const auto with = recorded_parameters(commission_robot(informed_log, informed));
  ASSERT_EQ(alone.size(), with.size());
  double tightest = 1.0;
  for (std::size_t j = 0; j < with.size(); ++j) {
    const double share = (with[j].upper - with[j].lower) / (alone[j].upper - alone[j].lower);
    RecordProperty("width_percent_" + with[j].name, static_cast<int>(100.0 * share));
    tightest = std::min(tightest, share);
    EXPECT_LE(share, 1.0 + 1e-6) << with[j].name;
  }
  EXPECT_LT(tightest, 0.9);
}

}  // namespace
}  // namespace wheelwright::study::examine_robot_test

// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "model/sim/simulation.hpp"
#include "results/scenario_file.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::sim::scenario_file_test {
namespace {

const std::string head =
    "robot:\n"                                                                          // line 1
    "  wheel_radius: 0.0975\n"                                                          // line 2
    "  track_width: 0.381\n"                                                            // line 3
    "  effort: {kind: torque, hold: zero_order}\n"                                      // line 4
    "parameters: {mass: 21, yaw_inertia: 0.9, viscous_linear: 4, viscous_yaw: 0.5}\n";  // line 5

std::string message(const std::string& text) {
  try {
    static_cast<void>(results::parse_scenario(text, "s.yaml"));
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(ScenarioFile, EveryKeyArrives) {
  const Scenario s = results::parse_scenario(head + R"(
trajectory: {kind: figure_eight, speed: 0.7, yaw_rate: 1.1, period: 12}
controller: {along: 1.5, across: 5, heading: 3, speed: 9, integral: 7, torque_limit: 6}
start: {pose: [1, 2, 0.5], error: [0.1, -0.1, 0.2]}
faults:
  - {kind: wheel_radius_left, magnitude: -0.01, onset: 20, shape: ramp, rise_time: 2}
  - {kind: unmatched, magnitude: 0.2, onset: 30, end: 31}
sensors:
  sampling: interval
  noise: truncated_gaussian
  wheel_speed: 0.01
  wheel_angle: 0.02
  effort: 0.03
  position: 0.04
  heading: 0.05
  encoder_counts_per_turn: 4096
  log: [speeds, pose]
duration: 90
rate: 200
time_jitter: 0.1
gaps: [[10, 12], [40, 41.5]]
seed: 77
)",
                                             "s.yaml");
  EXPECT_EQ(s.robot.wheel_radius, 0.0975);
  EXPECT_EQ(s.robot.hold, Hold::zero_order);
  EXPECT_EQ(s.parameters.mass, 21.0);
  EXPECT_EQ(s.parameters.viscous_x, 4.0);
  EXPECT_EQ(s.parameters.viscous_y, 4.0);
  EXPECT_EQ(s.parameters.viscous_yaw, 0.5);
  EXPECT_EQ(s.trajectory.kind, Trajectory::Kind::figure_eight);
  EXPECT_EQ(s.trajectory.yaw_rate, 1.1);
  EXPECT_EQ(s.controller.integral, 7.0);
  EXPECT_EQ(s.torque_limit, 6.0);
  EXPECT_EQ(s.initial_pose, Eigen::Vector3d(1.0, 2.0, 0.5));
  EXPECT_EQ(s.initial_pose_error, Eigen::Vector3d(0.1, -0.1, 0.2));
  ASSERT_EQ(s.faults.size(), 2U);
  EXPECT_EQ(s.faults[0].kind, model::Fault::Kind::wheel_radius_left);
  EXPECT_EQ(s.faults[0].profile.shape, model::TimeProfile::Shape::ramp);
  EXPECT_EQ(s.faults[0].profile.rise_time, 2.0);
  EXPECT_EQ(s.faults[1].profile.end, 31.0);
  EXPECT_EQ(s.sensors.sampling, Sampling::interval);
  EXPECT_EQ(s.sensors.noise, NoiseShape::truncated_gaussian);
  EXPECT_EQ(s.sensors.heading, 0.05);
  EXPECT_EQ(s.sensors.encoder_counts_per_turn, 4096.0);
  EXPECT_FALSE(s.sensors.angles);
  EXPECT_TRUE(s.sensors.speeds);
  EXPECT_FALSE(s.sensors.commands);
  EXPECT_EQ(s.duration, 90.0);
  EXPECT_EQ(s.rate, 200.0);
  EXPECT_EQ(s.time_jitter, 0.1);
  ASSERT_EQ(s.gaps.size(), 2U);
  EXPECT_EQ(s.gaps[1].upper, 41.5);
  EXPECT_EQ(s.seed, 77U);
}

TEST(ScenarioFile, FaultKindsAreCalledAsInTheLibrary) {
  ASSERT_EQ(model::simulated_faults().size(), 8U);
  for (const model::FaultKind expected : model::simulated_faults()) {
    const Scenario s = results::parse_scenario(
        head + "faults: [{kind: " + std::string(model::to_string(expected)) + ", magnitude: 0.01}]", "s.yaml");
    EXPECT_EQ(s.faults.at(0).kind, expected);
  }
  const std::array shapes{FaultProfile::Kind::step, FaultProfile::Kind::ramp, FaultProfile::Kind::smooth};
  for (std::size_t k = 0; k < shapes.size(); ++k) {
    const std::string name = std::array{"step", "ramp", "smooth"}.at(k);
    const Scenario s = results::parse_scenario(
        head + "faults: [{kind: slip_x, magnitude: 0.01, rise_time: 1, shape: " + name + "}]", "s.yaml");
    EXPECT_EQ(s.faults.at(0).profile.shape, shapes.at(k)) << name;
  }
  int kind = 0;
  for (const char* name : {"straight", "circle", "figure_eight", "multi_sine", "spin", "stops", "commissioning"}) {
    const Scenario s = results::parse_scenario(head + "trajectory: {kind: " + name + "}", "s.yaml");
    EXPECT_EQ(s.trajectory.kind, static_cast<Trajectory::Kind>(kind++)) << name;
  }
}

class ScenarioTable : public testing::ScratchTest {};

TEST_F(ScenarioTable, CommandsOfATableAreDriven) {
  put("commands.csv", "t,command_r,command_l,v1\n5,0,0,9\n6,2,1,9\n7,2,-2,9\n8,0,0,9\n");
  put("s.yaml", head + "trajectory: {kind: table, file: commands.csv}\n");
  const Scenario s = read_scenario(path("s.yaml"));
  EXPECT_EQ(s.trajectory.kind, Trajectory::Kind::table);
  EXPECT_EQ(s.duration, 3.0);
  EXPECT_EQ(s.trajectory.table.t, (std::vector<double>{0.0, 1.0, 2.0, 3.0}));
  // (5): v1 = r(ω_R + ω_L)/2, v2 = r(ω_R − ω_L)/D.
  EXPECT_NEAR(s.trajectory.table.speed[1][0], 0.0975 * 1.5, 1e-15);
  EXPECT_NEAR(s.trajectory.table.speed[1][1], 0.0975 / 0.381, 1e-15);
  const LogTable log = simulate(s);
  // The controller adds to the table's commands what the tracking error asks for, which is little.
  EXPECT_NEAR(log.column("command_r")[100], 2.0, 0.05);
  EXPECT_NEAR(log.column("command_l")[100], 1.0, 0.05);
  EXPECT_NEAR(log.column("command_l")[200], -2.0, 0.05);
}

TEST_F(ScenarioTable, TablesThatCannotBeDrivenAreInputErrors) {
  using ::testing::AllOf;
  using ::testing::HasSubstr;
  const auto said = [&](const std::string& trajectory) {
    put("s.yaml", head + "trajectory: " + trajectory + "\n");
    return testing::input_error([&] { static_cast<void>(read_scenario(path("s.yaml"))); });
  };
  EXPECT_THAT(said("{kind: table}"), AllOf(HasSubstr("s.yaml:6"), HasSubstr("file")));
  put("commands.csv", "t,command_r,command_l\n0,0,0\n1,1,1\n2,0,0\n");
  EXPECT_THAT(said("{kind: circle, file: commands.csv}"), AllOf(HasSubstr("s.yaml:6"), HasSubstr("kind: table")));
  EXPECT_THAT(said("{kind: table, file: nowhere.csv}"), HasSubstr("nowhere.csv"));
  put("half.csv", "t,command_r\n0,0\n1,1\n2,0\n");
  EXPECT_THAT(said("{kind: table, file: half.csv}"), AllOf(HasSubstr("half.csv"), HasSubstr("command_l")));
  put("back.csv", "t,command_r,command_l\n0,0,0\n1,1,1\n2,0,0\n0,1,1\n1,1,1\n");
  EXPECT_THAT(said("{kind: table, file: back.csv}"), AllOf(HasSubstr("back.csv"), HasSubstr("one drive")));
}

TEST(ScenarioFile, MessagesNameFileLineKeyValueAndExpectation) {
  using ::testing::AllOf;
  using ::testing::HasSubstr;
  EXPECT_EQ(message(head), "accepted");
  EXPECT_THAT(message(head + "duration: soon\n"), AllOf(HasSubstr("s.yaml:6: duration"), HasSubstr("'soon'")));
  EXPECT_THAT(message(head + "\ndurations: 3\n"), AllOf(HasSubstr("s.yaml:7"), HasSubstr("durations")));
  EXPECT_THAT(message(head + "trajectory: {kind: oval}\n"), AllOf(HasSubstr("s.yaml:6"), HasSubstr("figure_eight")));
  EXPECT_THAT(message(head + "faults:\n  - {kind: flat_tyre, magnitude: 1}\n"),
              AllOf(HasSubstr("s.yaml:7"), HasSubstr("flat_tyre"), HasSubstr("wheel_radius")));
  EXPECT_THAT(message(head + "faults:\n  - {kind: slip_x}\n"), AllOf(HasSubstr("s.yaml:7"), HasSubstr("magnitude")));
  EXPECT_THAT(message(head + "sensors: {effort: -1}\n"),
              AllOf(HasSubstr("s.yaml:6: sensors.effort"), HasSubstr(">= 0")));
  EXPECT_THAT(message(head + "seed: 1.5\n"), AllOf(HasSubstr("s.yaml:6: seed"), HasSubstr("whole")));
  EXPECT_THAT(message(head + "gaps: [[1, 2, 3]]\n"), AllOf(HasSubstr("s.yaml:6: gaps"), HasSubstr("[from, to]")));
  EXPECT_THAT(message(head + "start: {pose: [1, 2]}\n"), AllOf(HasSubstr("s.yaml:6: start.pose"), HasSubstr("three")));
  EXPECT_THAT(message(head + "rate: 0\n"), AllOf(HasSubstr("s.yaml:6: rate"), HasSubstr("> 0")));
  EXPECT_THAT(message(head + "rate: 10\nrate: 20\n"), HasSubstr("s.yaml:7"));
}

TEST(ScenarioFile, TheRobotsOwnMessagesNameItsOwnLines) {
  using ::testing::AllOf;
  using ::testing::HasSubstr;
  std::string bad = head;
  bad.replace(bad.find("0.381"), 5, "wide!");
  EXPECT_THAT(message(bad), AllOf(HasSubstr("s.yaml:3: track_width"), HasSubstr("wide!")));
  EXPECT_THAT(
      message("# flow\nrobot: {wheel_radius: 0.1,\n  track_widht: 0.4}\n" + head.substr(head.find("parameters"))),
      AllOf(HasSubstr("s.yaml:3"), HasSubstr("track_widht")));
  EXPECT_THAT(message("robot: [1]\n" + head.substr(head.find("parameters"))), HasSubstr("s.yaml:1: robot"));
  EXPECT_EQ(message("{robot: {wheel_radius: 0.1, track_width: 0.4}, parameters: {mass: 21, yaw_inertia: 0.9, "
                    "viscous_linear: 4, viscous_yaw: 0.5}}"),
            "accepted");
}

TEST(ScenarioFile, WhatDoesNotGoTogetherIsAnInputError) {
  using ::testing::HasSubstr;
  EXPECT_THAT(message(head + "faults: [{kind: wheel_radius, magnitude: -0.1}]\n"), HasSubstr("r + δ1 > 0"));
  EXPECT_THAT(message(head + "faults: [{kind: slip_x, magnitude: 0.1, shape: ramp}]\n"), HasSubstr("rise_time"));
  EXPECT_THAT(message("duration: 3\n"), HasSubstr("robot"));
  EXPECT_THAT(message(head.substr(0, head.find("parameters"))), HasSubstr("parameters"));
  const std::string robot = head.substr(0, head.find("parameters"));
  EXPECT_THAT(message(robot + "parameters: {mass: 21, yaw_inertia: 1, viscous_yaw: 1}\n"), HasSubstr("viscous_linear"));
  EXPECT_THAT(
      message(robot + "parameters: {mass: 21, yaw_inertia: 1, viscous_x: 1, viscous_linear: 2, viscous_yaw: 1}\n"),
      HasSubstr("viscous_linear"));
  EXPECT_THAT(message(robot + "parameters: {mass: 21, viscous_linear: 2, viscous_yaw: 1}\n"), HasSubstr("yaw_inertia"));
  EXPECT_THAT(message("robot: nowhere.yaml\n" + head.substr(head.find("parameters"))), HasSubstr("nowhere.yaml"));
}

TEST(ScenarioFile, ExamplesCanBeDriven) {
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(WHEELWRIGHT_SOURCE_DIR "/examples/scenarios")) {
    Scenario s = read_scenario(entry.path());
    s.duration = 2.0;
    EXPECT_GT(simulate(s).rows(), 100U) << entry.path();
    ++files;
  }
  EXPECT_GE(files, 3);
}

}  // namespace
}  // namespace wheelwright::sim::scenario_file_test

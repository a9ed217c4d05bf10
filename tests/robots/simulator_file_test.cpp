// SPDX-License-Identifier: Apache-2.0
// Simulators' files that are edited: what comes out is the robot that was meant, and nothing else changed.
#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <random>
#include <string>

#include <wheelwright/core/error.hpp>
#include <wheelwright/robots/robot_description.hpp>
#include <wheelwright/robots/simulator_file.hpp>
#include <wheelwright/robots/wheel_geometry.hpp>

#include "robots/robot_samples.hpp"
#include "robots/simulator_samples.hpp"

namespace wheelwright::robots::simulator_file_test {
namespace {

using model::SimulatorChange;
using testing::sample_mjcf;
using testing::sample_sdf;

Robot robot() {
  Robot out;
  out.wheel_radius = 0.1;
  out.track_width = 0.4;
  return out;
}

SimulatorChange change(std::initializer_list<const char*> members) {
  SimulatorChange out;
  for (const char* member : members) {
    out.because[member] = "a_cause";
  }
  return out;
}

EditedSimulator edited(SimulatorFormat format, const std::string& text, const SimulatorChange& wanted) {
  return edit_simulator(format, text, "robot.xml", wanted, robot());
}

std::string replaced(std::string text, const std::string& old, const std::string& now) {
  const std::size_t at = text.find(old);
  EXPECT_NE(at, std::string::npos) << old;
  return at == std::string::npos ? text : text.replace(at, old.size(), now);
}

std::string sample_of(SimulatorFormat format) {
  const testing::SampleRobot sample;
  return format == SimulatorFormat::mjcf  ? sample_mjcf
         : format == SimulatorFormat::sdf ? sample_sdf
                                          : sample_urdf(sample, usual_frames(sample));
}

class Format : public ::testing::TestWithParam<SimulatorFormat> {};

TEST_P(Format, WithoutChangesTheFileIsTheSame) {
  const EditedSimulator same = edited(GetParam(), sample_of(GetParam()), {});
  EXPECT_EQ(same.text, sample_of(GetParam()));
  EXPECT_TRUE(same.changed.empty());
  EXPECT_TRUE(same.not_expressed.empty());
}

// Both ways: what was added is taken away again by the opposite change, to nine digits.
TEST_P(Format, EditsAddUp) {
  SimulatorChange wanted = change({"mass", "yaw_inertia", "dry_friction", "damping"});
  wanted.mass = 3.0;
  wanted.yaw_inertia = 0.2;
  wanted.dry_friction = {0.1, 0.2};
  wanted.damping = {0.01, 0.02};
  const EditedSimulator once = edited(GetParam(), sample_of(GetParam()), wanted);
  SimulatorChange half = wanted;
  half.mass *= 0.5;
  half.yaw_inertia *= 0.5;
  half.dry_friction *= 0.5;
  half.damping *= 0.5;
  const EditedSimulator twice = edited(GetParam(), edited(GetParam(), sample_of(GetParam()), half).text, half);
  ASSERT_EQ(once.changed.size(), twice.changed.size());
  for (std::size_t k = 0; k < once.changed.size(); ++k) {
    EXPECT_EQ(once.changed[k].number, twice.changed[k].number);
  }
  // Lines that differ from the input are those that were said to be.
  std::size_t lines = 0;
  std::istringstream in(sample_of(GetParam())), out(once.text);
  for (std::string a, b; std::getline(in, a) && std::getline(out, b);) {
    lines += a != b ? 1 : 0;
  }
  EXPECT_GT(lines, 0U);
}

TEST_P(Format, BrokenFilesAreRefusedWithTheirPlaceOrEdited) {
  std::mt19937_64 random(11);
  const std::string spice = "<>/\"'= -+.e0123456789na&;${}";
  SimulatorChange wanted = change({"mass", "yaw_inertia", "dry_friction", "damping", "armature", "radius_factor",
                                   "track_factor", "gain", "effort_limit", "moment_ahead"});
  wanted.mass = 1.0;
  wanted.yaw_inertia = 0.1;
  wanted.moment_ahead = 0.1;
  wanted.dry_friction.setConstant(0.1);
  wanted.damping.setConstant(0.01);
  wanted.armature.setConstant(0.001);
  wanted.radius_factor.setConstant(1.02);
  wanted.track_factor = 1.03;
  wanted.gain.setConstant(0.9);
  wanted.effort_limit = 5.0;
  int read = 0;
  for (int k = 0; k < 600; ++k) {
    std::string text = sample_of(GetParam());
    for (std::uint64_t n = 0; n <= random() % 3; ++n) {
      const std::size_t at = random() % text.size();
      switch (random() % 4) {
        case 0: text.erase(at, 1 + random() % 12); break;
        case 1: text.insert(at, 1, spice[random() % spice.size()]); break;
        case 2: text.insert(at, text.substr(random() % text.size(), random() % 60)); break;
        default: text[at] = spice[random() % spice.size()];
      }
    }
    try {
      const EditedSimulator out = edited(GetParam(), text, wanted);
      // What was written can be read again.
      static_cast<void>(edited(GetParam(), out.text, {}));
      ++read;
    } catch (const InputError& error) {
      ASSERT_NE(std::string(error.what()).find("robot.xml"), std::string::npos) << error.what() << "\n" << text;
    }
  }
  EXPECT_GT(read, 30);
}

INSTANTIATE_TEST_SUITE_P(All, Format,
                         ::testing::Values(SimulatorFormat::mjcf, SimulatorFormat::urdf, SimulatorFormat::sdf),
                         [](const auto& tested) { return std::string(name_of(tested.param)); });

TEST(Mjcf, FrictionGearAndLimitsAreAttributesOfTheirElements) {
  SimulatorChange wanted = change({"dry_friction", "damping", "armature", "gain", "effort_limit"});
  wanted.dry_friction = {0.25, 0.5};
  wanted.damping = {0.01, 0.0};
  wanted.armature = {0.005, 0.005};
  wanted.gain = {0.5, 1.0};
  wanted.effort_limit = 4.0;
  std::string expected = sample_mjcf;
  expected =
      replaced(expected, "<joint name=\"left\" />", "<joint name=\"left\" frictionloss=\"0.5\" armature=\"0.015\" />");
  expected = replaced(expected, "damping=\"0.03\"/>", "damping=\"0.04\" frictionloss=\"0.25\" armature=\"0.015\"/>");
  expected = replaced(expected, "joint=\"left\"/>", "joint=\"left\" forcerange=\"-2 2\" forcelimited=\"true\"/>");
  expected =
      replaced(expected, "gear=\"2 0 0 0 0 0\"/>", "gear=\"1 0 0 0 0 0\" forcerange=\"-4 4\" forcelimited=\"true\"/>");
  const EditedSimulator out = edited(SimulatorFormat::mjcf, sample_mjcf, wanted);
  EXPECT_EQ(out.text, expected);
  EXPECT_TRUE(out.not_expressed.empty());
  EXPECT_EQ(out.right, "right");
  EXPECT_EQ(out.left, "left");
}

TEST(Mjcf, WhatMakesOtherBodiesIsRefused) {
  for (const auto& [old, now] : std::initializer_list<std::pair<std::string, std::string>>{
           {"<worldbody>", "<include file=\"a.xml\"/>\n<worldbody>"},
           {"<freejoint/>", "<freejoint/><frame pos=\"1 0 0\"/>"},
           {"angle=\"degree\"", "angle=\"degree\" coordinate=\"global\""},
           {"<mujoco model=\"cart\">", "<mujoco model=\"cart\"><default class=\"x\"><default/></default>"}}) {
    EXPECT_THROW(static_cast<void>(edited(SimulatorFormat::mjcf, replaced(sample_mjcf, old, now), {})), InputError)
        << now;
  }
  EXPECT_THROW(static_cast<void>(edited(SimulatorFormat::mjcf, "<robot name=\"a\"/>", {})), InputError);
}

TEST(Mjcf, MassesThatTheEngineMakesAreNotWritten) {
  SimulatorChange wanted = change({"mass"});
  wanted.mass = 2.0;
  for (const char* compiler : {"inertiafromgeom=\"true\"", "settotalmass=\"20\""}) {
    const std::string text =
        replaced(sample_mjcf, "autolimits=\"true\"", std::string("autolimits=\"true\" ") + compiler);
    const EditedSimulator out = edited(SimulatorFormat::mjcf, text, wanted);
    EXPECT_EQ(out.text, text);
    ASSERT_EQ(out.not_expressed.size(), 1U);
    EXPECT_NE(out.not_expressed[0].instead.find("2 kg"), std::string::npos) << out.not_expressed[0].instead;
  }
}

// lumped_body and axle of the library's own reader are the oracle: exact sums over the links of what was written.
TEST(Urdf, TheRobotHasWhatWasAdded) {
  std::mt19937_64 random(3);
  for (int k = 0; k < 8; ++k) {
    const testing::SampleRobot sample;
    const std::string text = sample_urdf(sample, random_frames(sample, random));
    SimulatorChange wanted = change({"mass", "yaw_inertia", "moment_ahead", "moment_left", "armature"});
    wanted.mass = 2.5;
    wanted.yaw_inertia = k % 2 == 0 ? 0.3 : -0.02;
    wanted.moment_ahead = 0.4;
    wanted.moment_left = -0.2;
    wanted.armature = {0.003, 0.002};
    const auto lumped = [](const std::string& urdf) {
      const RobotTree tree = parse_urdf(urdf, "robot.urdf");
      const WheelJoints wheels = driven_wheels(tree, {});
      return lumped_body(tree, wheels, axle(tree, wheels), {});
    };
    const LumpedBody before = lumped(text);
    const EditedSimulator out = edited(SimulatorFormat::urdf, text, wanted);
    ASSERT_TRUE(out.not_expressed.empty()) << out.not_expressed[0].why;
    const LumpedBody after = lumped(out.text);
    EXPECT_NEAR(after.mass, before.mass + 2.5, 1e-7);
    EXPECT_NEAR(after.yaw_inertia, before.yaw_inertia + wanted.yaw_inertia, 1e-7);
    EXPECT_NEAR(after.spin, before.spin + 0.005, 1e-9);
    EXPECT_NEAR(after.mass * after.ahead, before.mass * before.ahead + 0.4, 1e-7);
    EXPECT_NEAR(after.mass * after.left, before.mass * before.left - 0.2, 1e-7);
  }
}

TEST(Urdf, WheelsGrowAndMoveApart) {
  std::mt19937_64 random(4);
  const testing::SampleRobot sample;
  const std::string text = sample_urdf(sample, random_frames(sample, random));
  SimulatorChange wanted = change({"radius_factor", "track_factor"});
  wanted.radius_factor = {1.02, 1.02};
  wanted.track_factor = 1.1;
  const RobotTree tree = parse_urdf(edited(SimulatorFormat::urdf, text, wanted).text, "robot.urdf");
  const WheelJoints wheels = driven_wheels(tree, {});
  const Axle line = axle(tree, wheels);
  EXPECT_NEAR(line.track_width, 1.1 * sample.track, 1e-8);
  EXPECT_NEAR(wheel_radius(tree, wheels).value.value(), 1.02 * sample.radius, 1e-9);
  EXPECT_NEAR(line.middle.z(), sample.radius + 0.02 * sample.radius, 1e-8) << "the wheels stay on the ground";
}

TEST(Urdf, GainHasNoPlace) {
  SimulatorChange wanted = change({"gain"});
  wanted.gain = {0.8, 1.0};
  const testing::SampleRobot sample;
  const std::string text = sample_urdf(sample, usual_frames(sample));
  const EditedSimulator out = edited(SimulatorFormat::urdf, text, wanted);
  EXPECT_EQ(out.text, text);
  ASSERT_EQ(out.not_expressed.size(), 1U);
  EXPECT_NE(out.not_expressed[0].instead.find("0.8"), std::string::npos);
}

TEST(Sdf, NumbersAreTextOfTheirElements) {
  SimulatorChange wanted = change({"dry_friction", "effort_limit", "radius_factor", "track_factor", "mass"});
  wanted.dry_friction = {0.25, 0.5};
  wanted.effort_limit = 7.0;
  wanted.radius_factor = {1.0, 1.1};
  wanted.track_factor = 1.5;
  wanted.mass = 3.0;
  std::string expected = sample_sdf;
  expected = replaced(expected, "<mass>12</mass>", "<mass>15</mass>");
  // The first moment stays: 12·0.02/15.
  expected = replaced(expected, "<pose>0.02 0 0.05 0 0 0</pose>", "<pose>0.016 0 0.05 0 0 0</pose>");
  // And so does the moment about the axle: 0.4 + 12·0.02² − 15·0.016².
  expected = replaced(expected, "<ixx>0.3</ixx><iyy>0.35</iyy><izz>0.4</izz>",
                      "<ixx>0.30096</ixx><iyy>0.35096</iyy><izz>0.40096</izz>");
  expected = replaced(expected, "<pose>0 0.2 0.1 -1.57", "<pose>0 0.3 0.11 -1.57");
  expected = replaced(expected, "\"chassis\">0 -0.2 0 -1.57", "\"chassis\">0 -0.3 0 -1.57");
  expected = replaced(expected, "<radius> 0.1 </radius>", "<radius> 0.11 </radius>");
  expected = replaced(expected, "<effort>20</effort>", "<effort>7</effort>");
  expected = replaced(expected, "<damping>0.02</damping></dynamics>",
                      "<damping>0.02</damping>\n          <friction>0.5</friction></dynamics>");
  const EditedSimulator out = edited(SimulatorFormat::sdf, sample_sdf, wanted);
  // The right joint has no dynamics and no limit yet: both are put into its axis.
  const std::size_t at = expected.find("<axis><xyz expressed_in");
  EXPECT_EQ(out.text.substr(0, at), expected.substr(0, at));
  const std::string rest = out.text.substr(at);
  EXPECT_NE(rest.find("<friction>0.25</friction>"), std::string::npos) << rest;
  EXPECT_NE(rest.find("<effort>7</effort>"), std::string::npos) << rest;
  static_cast<void>(edited(SimulatorFormat::sdf, out.text, {}));
}

TEST(Sdf, OneRobotAndNoIncludes) {
  EXPECT_THROW(static_cast<void>(edited(SimulatorFormat::sdf,
                                        replaced(sample_sdf, "<link name=\"chassis\">",
                                                 "<include><uri>a</uri></include><link name=\"chassis\">"),
                                        {})),
               InputError);
  EXPECT_THROW(
      static_cast<void>(
          edited(SimulatorFormat::sdf, replaced(sample_sdf, "relative_to=\"chassis\"", "relative_to=\"nowhere\""), {})),
      InputError);
}

}  // namespace
}  // namespace wheelwright::robots::simulator_file_test

// SPDX-License-Identifier: Apache-2.0
// Simulators' files that are edited: what comes out is the robot that was meant, and nothing else changed.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <string>

#include "core/error.hpp"
#include "formats/robots/robot_description.hpp"
#include "formats/robots/simulator_document.hpp"
#include "formats/robots/simulator_file.hpp"
#include "formats/robots/wheel_geometry.hpp"
#include "tests/robots/robot_samples.hpp"
#include "tests/robots/simulator_samples.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::robots::simulator_file_test {
namespace {

using model::SimulatorChange;
using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::input_error;
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

TEST_P(Format, WhatWouldLeaveNoBodyIsSaidAndNotWritten) {
  const std::string text = sample_of(GetParam());
  SimulatorChange damping = change({"damping"});
  damping.damping = {-10.0, -10.0};
  const EditedSimulator still = edited(GetParam(), text, damping);
  ASSERT_EQ(still.not_expressed.size(), 2U);
  EXPECT_THAT(still.not_expressed[0].why, HasSubstr("below 0"));
  // The file has 0 now: there is nothing left to take.
  EXPECT_EQ(edited(GetParam(), still.text, damping).text, still.text);

  SimulatorChange mass = change({"mass"}), moment = change({"yaw_inertia"});
  mass.mass = -100.0;
  moment.yaw_inertia = -100.0;
  for (const auto& [wanted, why] :
       {std::pair{mass, "would have a mass of"}, std::pair{moment, "would have a moment of"}}) {
    const EditedSimulator out = edited(GetParam(), text, wanted);
    EXPECT_EQ(out.text, text);
    ASSERT_EQ(out.not_expressed.size(), 1U);
    EXPECT_THAT(out.not_expressed[0].why, HasSubstr(why));
    EXPECT_EQ(out.not_expressed[0].cause, "a_cause");
  }
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

TEST(Mjcf, BrokenNumbersAreRefusedAndNamed) {
  const auto error = [](const std::string& old, const std::string& now) {
    return input_error([&] { static_cast<void>(open_mjcf(replaced(sample_mjcf, old, now), "robot.xml")); });
  };
  EXPECT_THAT(error("angle=\"degree\"", "eulerseq=\"xyw\""),
              AllOf(HasSubstr("eulerseq"), HasSubstr("expected three of")));
  EXPECT_THAT(error("euler=\"-90 0 0\"", "quat=\"0 0 0 0\""), HasSubstr("quat of length 0"));
  EXPECT_THAT(error("zaxis=\"0 1 0\"", "zaxis=\"0 0 0\""), HasSubstr("a direction of length 0"));
  EXPECT_THAT(error("zaxis=\"0 1 0\"", "xyaxes=\"1 0 0 2 0 0\""), HasSubstr("a direction of length 0"));
  EXPECT_THAT(error("<geom class=\"wheel\"/>", "<geom class=\"wheel\" fromto=\"0 0 1 0 0 1\"/>"),
              HasSubstr("fromto of length 0"));
  EXPECT_THAT(error("<joint name=\"left\" />", "<joint name=\"left\" axis=\"0 0 0\"/>"), HasSubstr("axis of length 0"));
  std::string chain;
  for (int k = 0; k < 202; ++k) {
    chain = "<body>" + chain + "</body>";
  }
  EXPECT_THAT(error("<freejoint/>", "<freejoint/>" + chain), HasSubstr("robot.xml:"));
}

TEST(Mjcf, AnOrientationMayBeWrittenAnyhow) {
  // What the frames of wheels and inertial say is what is edited: moved wheels, and moments in the inertial's frame.
  SimulatorChange wanted = change({"yaw_inertia", "moment_left", "track_factor"});
  wanted.yaw_inertia = 0.3;
  wanted.moment_left = 0.4;
  wanted.track_factor = 1.5;
  const std::string wheel = "euler=\"-90 0 0\"", inertial = "quat=\"0.9659258262890683 0.25881904510252074 0 0\"";
  const std::string expected = edited(SimulatorFormat::mjcf, sample_mjcf, wanted).text;
  for (const std::string way : {"quat=\"2 -2 0 0\"", "axisangle=\"1 0 0 -90\"", "axisangle=\"-3 0 0 90\"",
                                "xyaxes=\"1 0 0 0 0 -1\"", "xyaxes=\"2 0 0 1 0 -1\""}) {
    EXPECT_EQ(edited(SimulatorFormat::mjcf, replaced(sample_mjcf, wheel, way), wanted).text,
              replaced(expected, wheel, way));
  }
  const double half = std::sqrt(0.75);
  for (const std::string& way : {std::string("axisangle=\"2 0 0 30\""), std::string("euler=\"30 0 0\""),
                                 fmt::format("xyaxes=\"1 0 0 0 {:.17g} 0.5\"", half)}) {
    EXPECT_EQ(edited(SimulatorFormat::mjcf, replaced(sample_mjcf, inertial, way), wanted).text,
              replaced(expected, inertial, way));
  }
}

// Mass, centre and moments as sums over a lattice of points inside the shape.
TEST(Mjcf, GeomsWeighWhatTheirShapeHolds) {
  using Point = Eigen::Vector3d;
  struct Case {
    std::string geom;
    std::function<bool(const Point&)> inside;
  };
  const auto ring = [](const Point& p) { return std::hypot(p.x(), p.y()); };
  const Eigen::Vector3d from(0.1, 0.0, -0.2), to(0.3, 0.2, 0.1), along = (to - from).normalized();
  const auto by_line = [&](const Point& p) {  // along and across the line from `from` to `to`
    const Point d = p - 0.5 * (from + to);
    return std::pair{std::abs(d.dot(along)), (d - d.dot(along) * along).norm()};
  };
  const double reach = 0.5 * (to - from).norm();
  const std::string ends = "fromto=\"0.1 0 -0.2 0.3 0.2 0.1\"";
  const std::vector<Case> cases = {
      {"type=\"sphere\" size=\"0.3\"", [](const Point& p) { return p.norm() < 0.3; }},
      {"type=\"box\" size=\"0.3 0.2 0.1\"",
       [](const Point& p) { return std::abs(p.x()) < 0.3 && std::abs(p.y()) < 0.2 && std::abs(p.z()) < 0.1; }},
      {"type=\"cylinder\" size=\"0.2 0.3\"", [&](const Point& p) { return ring(p) < 0.2 && std::abs(p.z()) < 0.3; }},
      {"type=\"capsule\" size=\"0.2 0.15\"",
       [&](const Point& p) { return std::hypot(ring(p), std::max(std::abs(p.z()) - 0.15, 0.0)) < 0.2; }},
      {"type=\"ellipsoid\" size=\"0.3 0.2 0.1\"",
       [](const Point& p) { return Point(p.x() / 0.3, p.y() / 0.2, p.z() / 0.1).norm() < 1.0; }},
      {"type=\"cylinder\" size=\"0.15\" " + ends,
       [&](const Point& p) { return by_line(p).first < reach && by_line(p).second < 0.15; }},
      {"type=\"capsule\" size=\"0.1\" " + ends,
       [&](const Point& p) { return std::hypot(std::max(by_line(p).first - reach, 0.0), by_line(p).second) < 0.1; }},
      {"type=\"ellipsoid\" size=\"0.15\" " + ends,
       [&](const Point& p) { return std::hypot(by_line(p).first / reach, by_line(p).second / 0.15) < 1.0; }}};
  std::string bare = replaced(
      sample_mjcf, "<inertial pos=\"0.02 0 0.05\" quat=\"0.9659258262890683 0.25881904510252074 0 0\"", "<site");
  bare = replaced(bare, "mass=\"12\" diaginertia=\"0.3 0.35 0.4\"/>", "/>");
  for (const char* castor : {"pos=\"0.2 0 -0.07\"", "pos=\"-0.2 0 -0.07\""}) {
    bare = replaced(bare, castor, std::string(castor) + " mass=\"0\"");
  }
  for (const Case& one : cases) {
    const auto document = open_mjcf(replaced(bare, "<geom type=\"box\" size=\"0.25 0.15 0.05\" pos=\"0 0 0.08\"",
                                             "<geom density=\"800\" " + one.geom),
                                    "robot.xml");
    const TreeLink* const body = document->tree().link("chassis");
    ASSERT_TRUE(body != nullptr && body->inertial.has_value()) << one.geom;
    constexpr double cell = 0.01;
    double mass = 0.0;
    Point first = Point::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    for (double x = -0.5; x < 0.5; x += cell) {
      for (double y = -0.5; y < 0.5; y += cell) {
        for (double z = -0.5; z < 0.5; z += cell) {
          if (const Point p = Point(x, y, z) + 0.5 * Point::Constant(cell); one.inside(p)) {
            mass += 800.0 * cell * cell * cell;
            first += 800.0 * cell * cell * cell * p;
            second += 800.0 * cell * cell * cell * (p * p.transpose());
          }
        }
      }
    }
    const Point centre = first / mass;
    const Eigen::Matrix3d about = second - mass * centre * centre.transpose();
    const Eigen::Matrix3d tensor = about.trace() * Eigen::Matrix3d::Identity() - about;
    EXPECT_NEAR(body->inertial->mass / mass, 1.0, 0.02) << one.geom;
    EXPECT_LT((body->inertial->centre - centre).norm(), 0.002) << one.geom;
    EXPECT_LT((body->inertial->tensor - tensor).norm(), 0.03 * tensor.norm()) << one.geom;
  }
}

TEST(Mjcf, GainsAreScaledInEveryActuator) {
  SimulatorChange wanted = change({"gain"});
  wanted.gain = {1.0, 0.5};  // of the left wheel
  for (const auto& [before, after] : std::initializer_list<std::pair<std::string, std::string>>{
           {"<velocity name=\"l\" joint=\"left\" kv=\"8\"/>", "<velocity name=\"l\" joint=\"left\" kv=\"4\"/>"},
           {"<velocity name=\"l\" joint=\"left\"/>", "<velocity name=\"l\" joint=\"left\" kv=\"0.5\"/>"},
           {"<position name=\"l\" joint=\"left\" kp=\"8\" kv=\"2\"/>",
            "<position name=\"l\" joint=\"left\" kp=\"4\" kv=\"1\"/>"},
           {"<general name=\"l\" joint=\"left\" gainprm=\"8\" biastype=\"affine\" biasprm=\"1 -4 -2\"/>",
            "<general name=\"l\" joint=\"left\" gainprm=\"4\" biastype=\"affine\" biasprm=\"0.5 -2 -1\"/>"}}) {
    const std::string motor = "<motor name=\"l\" joint=\"left\"/>";
    const EditedSimulator out = edited(SimulatorFormat::mjcf, replaced(sample_mjcf, motor, before), wanted);
    EXPECT_EQ(out.text, replaced(sample_mjcf, motor, after));
    EXPECT_TRUE(out.not_expressed.empty());
  }
}

TEST(Mjcf, AWheelThatIsAnEllipsoidRollsOnItsTwoEqualAxes) {
  SimulatorChange wanted = change({"radius_factor"});
  wanted.radius_factor = {1.0, 1.5};
  const std::string text =
      replaced(sample_mjcf, "<geom/>", "<geom type=\"ellipsoid\" size=\"0.1 0.1 0.02\" mass=\"1\"/>");
  const std::string out = edited(SimulatorFormat::mjcf, text, wanted).text;
  EXPECT_NE(out.find("size=\"0.15 0.15 0.02\""), std::string::npos) << out;
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

TEST(Urdf, ARotorThatLeavesNoWheelIsSaid) {
  SimulatorChange wanted = change({"armature"});
  wanted.armature = {-1.0, 0.0};
  const std::string text = sample_of(SimulatorFormat::urdf);
  const EditedSimulator out = edited(SimulatorFormat::urdf, text, wanted);
  EXPECT_EQ(out.text, text);
  ASSERT_EQ(out.not_expressed.size(), 1U);
  EXPECT_THAT(out.not_expressed[0].why, AllOf(HasSubstr("right_wheel"), HasSubstr("would be no body's inertia")));
}

// base_footprint, which most robots of ROS have, is a frame; a link with a shape has a mass that the file does not
// tell.
TEST(Urdf, AnotherMassThanTheRobotFilesIsSaid) {
  const testing::SampleRobot sample;
  const std::string with_frame = sample_of(SimulatorFormat::urdf), frame = "<link name=\"base_footprint\"/>\n";
  const std::string with_shape =
      replaced(with_frame, frame,
               "<link name=\"base_footprint\"><visual><geometry><box size=\"1 1 1\"/></geometry></visual></link>\n");
  std::string all_known = replaced(with_frame, frame, "");
  const std::size_t joint = all_known.find("<joint name=\"base_joint\"");
  all_known.erase(joint, all_known.find('\n', joint) + 1 - joint);
  Robot own;
  own.wheel_radius = sample.radius;
  own.track_width = sample.track;
  for (const double factor : {1.0, 1.1, 0.9}) {
    own.nominal["mass"] = factor * (sample.mass() + sample.spin() / (sample.radius * sample.radius));
    const auto remarks = [&](const std::string& text) {
      return edit_simulator(SimulatorFormat::urdf, text, "robot.urdf", {}, own).remarks;
    };
    for (const std::string& text : {all_known, with_frame}) {
      if (factor == 1.0) {
        EXPECT_THAT(remarks(text), ::testing::IsEmpty());
      } else {
        EXPECT_THAT(remarks(text), ::testing::ElementsAre(HasSubstr("mass with the wheels' 2J/r²")));
      }
    }
    EXPECT_THAT(remarks(with_shape), ::testing::IsEmpty());
  }
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

TEST(Sdf, BrokenNumbersAreRefusedAndNamed) {
  const auto error = [](const std::string& old, const std::string& now) {
    return input_error([&] { static_cast<void>(open_sdf(replaced(sample_sdf, old, now), "robot.sdf")); });
  };
  EXPECT_THAT(error("<link name=\"chassis\">", "<model name=\"m\"/><link name=\"chassis\">"),
              HasSubstr("a model inside a model"));
  EXPECT_THAT(error("<parent>chassis</parent><child>left_wheel</child>", "<parent>chassis</parent>"),
              HasSubstr("holds no <child>"));
  EXPECT_THAT(error("<pose>0 0.2 0.1 -1.5707963267948966 0 0</pose>",
                    "<pose rotation_format=\"quat_xyzw\">0 0.2 0.1 0 0 0 1</pose>"),
              HasSubstr("has another rotation_format"));
  EXPECT_THAT(error("relative_to=\"chassis\"", "relative_to=\"right_wheel\""), HasSubstr("relative to itself"));
  EXPECT_THAT(error("<radius> 0.1 </radius>", "<radius>-0.1</radius>"), HasSubstr("expected metres, > 0"));
  EXPECT_THAT(error("<xyz>0 0 1</xyz>", "<xyz>0 0 0</xyz>"), HasSubstr("a direction of length 0"));
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

// SPDX-License-Identifier: Apache-2.0
// What URDF and controllers' files cannot be used for: each message names file, line and element.
#include <functional>
#include <regex>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "formats/robots/controller_file.hpp"
#include "formats/robots/robot_description.hpp"
#include "formats/robots/robot_file.hpp"
#include "formats/robots/robot_origin.hpp"
#include "tests/robots/robot_samples.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::robots::robot_origin_errors_test {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::input_error;
using testing::SampleRobot;

std::string sample_text(const std::string& more = "") {
  const SampleRobot sample;
  return sample_urdf(sample, usual_frames(sample), more);
}

RobotWithOrigins from_urdf(const std::string& text, const RobotHints& hints = {}) {
  const RobotTree tree = parse_urdf(text, "robot.urdf");
  return robot_from(&tree, nullptr, hints);
}

/// `text` with the first `from` behind `anchor` written as `to`.
std::string changed(std::string text, const std::string& anchor, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from, text.find(anchor));
  EXPECT_NE(at, std::string::npos) << from;
  return at == std::string::npos ? text : text.replace(at, from.size(), to);
}

std::string refused(const std::string& anchor, const std::string& from, const std::string& to) {
  return input_error([&] { from_urdf(changed(sample_text(), anchor, from, to)); });
}

std::string urdf_error(const std::string& text, const std::string& file) {
  return input_error([&] { static_cast<void>(parse_urdf(text, file)); });
}

std::string yaml_error(const std::string& text, const std::string& file, const std::string& controller = {}) {
  return input_error([&] { static_cast<void>(parse_ros2_control(text, file, controller)); });
}

// A chain of 60,000 links and an element of 400,000 attributes (6 MB each) were read for more than 20 s.
TEST(RobotOriginErrors, WhatNoRobotHasIsRefusedByItsLimit) {
  const auto chain = [](int links) {
    std::string text = "<robot name=\"r\">\n";
    for (int k = 0; k < links; ++k) {
      text += fmt::format("<link name=\"l{}\"/>", k);
    }
    for (int k = 1; k < links; ++k) {
      text +=
          fmt::format(R"(<joint name="j{0}" type="fixed"><parent link="l{1}"/><child link="l{0}"/></joint>)", k, k - 1);
    }
    return text + "</robot>";
  };
  EXPECT_EQ(urdf_error(chain(60'000), "robot.urdf"),
            "robot.urdf:1: robot 'r': 60000 links and 59999 joints: expected at most 5000 of each");
  EXPECT_EQ(urdf_error(chain(300), "robot.urdf"),
            "robot.urdf:2: link 'l201': hangs on 201 joints in a row: expected at most 200");
  EXPECT_EQ(parse_urdf(chain(201), "robot.urdf").links.size(), 201u);
  std::string attributes = "<!-- a=1 --><robot name='r'>\n<link name=\"a\"";
  for (int k = 0; k < 400'000; ++k) {
    attributes += fmt::format(" a{}='>'", k);
  }
  EXPECT_EQ(urdf_error(attributes + "/></robot>", "robot.urdf"),
            "robot.urdf:2: an element with more than 1000 attributes: expected a robot description");
}

TEST(RobotOriginErrors, ValuesThatNoBodyHas) {
  EXPECT_EQ(refused("base_link\">", "mass value=\"10\"", "mass value=\"-3\""),
            "robot.urdf:6: <inertial> of link 'base_link': mass -3: expected a mass > 0 in kg");
  EXPECT_THAT(refused("base_link\">", "mass value=\"10\"", "mass value=\"0\""), HasSubstr("robot.urdf:6: <inertial>"));
  EXPECT_THAT(refused("base_link\">", "mass value=\"10\"", "mass value=\"nan\""),
              HasSubstr("robot.urdf:8: <mass> of link 'base_link': value 'nan': expected a finite number"));
  EXPECT_THAT(refused("base_link\">", "mass value=\"10\"", "mass value=\"ten\""), HasSubstr("robot.urdf:8: <mass>"));
  EXPECT_THAT(refused("base_link\">", "<mass value=\"10\"/>", ""),
              HasSubstr("robot.urdf:6: <inertial> of link 'base_link': holds no <mass>"));
  // A box of 0.4 by 0.3 by 0.2: ixx of 10 is larger than the others' sum.
  EXPECT_THAT(refused("base_link\">", "ixx=\"0.1", "ixx=\"9.1"),
              AllOf(HasSubstr("robot.urdf:6: <inertial>"), HasSubstr("larger than the sum of the others")));
  EXPECT_THAT(refused("base_link\">", "ixx=\"", "ixx=\"-"), HasSubstr("expected none below 0"));
  EXPECT_THAT(refused("base_link\">", "ixy=\"0\"", ""),
              HasSubstr("robot.urdf:9: <inertia> of link 'base_link': has no attribute ixy"));
  EXPECT_THAT(refused("base_link\">", "xyz=\"", "xyz=\"1 "),
              AllOf(HasSubstr("robot.urdf:7: <origin>"), HasSubstr("expected 3 finite numbers")));
}

TEST(RobotOriginErrors, LinksWithoutAMass) {
  const std::string camera =
      "<link name=\"camera\"><visual><geometry><box size=\"1 1 1\"/></geometry></visual></link>\n<joint name=\"c\" "
      "type=\"fixed\"><parent link=\"base_link\"/><child link=\"camera\"/></joint>";
  EXPECT_THAT(input_error([&] { from_urdf(sample_text(camera)); }),
              AllOf(HasSubstr("link 'camera': has a shape and no <inertial>"), HasSubstr("--massless camera")));
  RobotHints hints;
  hints.massless = {"camera"};
  EXPECT_EQ(from_urdf(sample_text(camera), hints).robot.nominal, from_urdf(sample_text()).robot.nominal);
  const std::string lamp =
      "\n<link name=\"lamp\"><visual><geometry><box size=\"1 1 1\"/></geometry></visual></link>\n<joint name=\"d\" "
      "type=\"fixed\"><parent link=\"base_link\"/><child link=\"lamp\"/></joint>";
  EXPECT_THAT(input_error([&] { from_urdf(sample_text(camera + lamp)); }),
              HasSubstr("as have lamp: expected mass and inertia, or --massless camera --massless lamp"));
  hints.massless = {"all"};
  EXPECT_EQ(from_urdf(sample_text(camera + lamp), hints).robot.nominal, from_urdf(sample_text()).robot.nominal);
  hints.massless = {"camra"};
  EXPECT_THAT(input_error([&] { from_urdf(sample_text(camera), hints); }), HasSubstr("did you mean 'camera'?"));
  hints.massless = {"mast"};
  EXPECT_THAT(input_error([&] { from_urdf(sample_text(), hints); }), HasSubstr("<inertial> of link 'mast'"));
}

TEST(RobotOriginErrors, WheelsThatDoNotRoll) {
  EXPECT_THAT(refused("left_wheel", "<cylinder radius=\"0.05\"", "<cylinder radius=\"0\""),
              HasSubstr("<cylinder> of link 'left_wheel': radius 0"));
  EXPECT_THAT(refused("left_wheel", "<cylinder radius=\"0.05\"", "<cylinder radius=\"0.0501\""),
              AllOf(HasSubstr("link 'left_wheel': radius 0.0501 m, and 0.05 m at robot.urdf:"),
                    HasSubstr("wheel_radius_asymmetric")));
  EXPECT_THAT(refused("left_wheel", "<collision><origin xyz=\"", "<collision><origin xyz=\"0.1"),
              HasSubstr("off the axis of robot.urdf:34: joint 'left_wheel_joint'"));
  EXPECT_THAT(refused("left_wheel_joint", "axis xyz=\"", "axis xyz=\"1"), HasSubstr("only one joint"));
}

TEST(RobotOriginErrors, WheelsThatAreNotFound) {
  RobotHints hints;
  hints.left = {"left_weel_joint"};
  hints.right = {"right_wheel_joint"};
  EXPECT_THAT(input_error([&] { from_urdf(sample_text(), hints); }),
              AllOf(HasSubstr("--left and --right: robot.urdf:2"), HasSubstr("did you mean 'left_wheel_joint'?")));
  hints.left = {"mast_joint"};
  EXPECT_THAT(input_error([&] { from_urdf(sample_text(), hints); }), HasSubstr("joint 'mast_joint': is 'fixed'"));
  hints.left = {"right_wheel_joint"};
  EXPECT_THAT(input_error([&] { from_urdf(sample_text(), hints); }), HasSubstr("is both wheels"));
  std::swap(hints.left, hints.right);
  hints.right = {"left_wheel_joint"};
  EXPECT_THAT(input_error([&] { from_urdf(sample_text(), hints); }),
              HasSubstr("expected the left one at the larger y"));
  hints.right.clear();
  EXPECT_THAT(input_error([&] { from_urdf(sample_text(), hints); }), HasSubstr("one side only"));
  // Neither continuous nor named: the joints that turn are listed.
  EXPECT_THAT(refused("left_wheel_joint", "continuous", "revolute"),
              AllOf(HasSubstr("only one joint"), HasSubstr("left_wheel_joint (robot.urdf:"), HasSubstr("--left")));
}

TEST(RobotOriginErrors, WheelsThatShareNoAxle) {
  RobotHints hints;
  hints.left = {"left_wheel_joint"};
  hints.right = {"right_wheel_joint"};
  const auto error = [&](const std::string& text) { return input_error([&] { from_urdf(text, hints); }); };
  const auto at = [](const std::string& xyz) {
    const std::string text = sample_text();
    const std::string joint =
        "left_wheel_joint\" type=\"continuous\">\n<parent link=\"base_link\"/>\n<child "
        "link=\"left_wheel\"/>\n<origin xyz=\"";
    const std::size_t from = text.find(joint) + joint.size();
    return std::string(text).replace(from, text.find('"', from) - from, xyz);
  };
  EXPECT_NO_THROW(from_urdf(at("0 0.19 0.05"), hints));
  EXPECT_THAT(error(at("0.1 0.19 0.05")), HasSubstr("do not share an axle"));
  EXPECT_THAT(error(changed(sample_text(), "left_wheel_joint", "axis xyz=\"", "axis xyz=\"1")),
              HasSubstr("has another axis than"));
}

TEST(RobotOriginErrors, MoreWheelsThanTwo) {
  const auto further = [](const std::string& name, double x, double y) {
    return fmt::format(
        "<link name=\"{0}\"/><joint name=\"{0}_joint\" type=\"continuous\"><parent link=\"base_link\"/><child "
        "link=\"{0}\"/><origin xyz=\"{1} {2} 0.05\"/><axis xyz=\"0 1 0\"/></joint>\n",
        name, x, y);
  };
  EXPECT_THAT(input_error([&] { from_urdf(sample_text(further("third_wheel", 0.3, 0.0))); }),
              AllOf(HasSubstr("3 joints may be driven wheels"), HasSubstr("third_wheel_joint (robot.urdf:")));
  // What does not say wheel, or says caster, is none.
  EXPECT_NO_THROW(from_urdf(sample_text(further("caster_wheel", 0.3, 0.0) + further("brush", 0.2, 0.0))));
  const std::string skid =
      "<gazebo><plugin name=\"d\" filename=\"libgazebo_ros_skid_steer_drive.so\"></plugin></gazebo>";
  EXPECT_THAT(input_error([&] { from_urdf(sample_text(skid)); }), HasSubstr("more than two wheels"));
}

TEST(RobotOriginErrors, PluginsThatCannotBeUsed) {
  const auto error = [](const std::string& keys, const std::string& more = "") {
    return input_error([&] {
      from_urdf(sample_text("<gazebo>\n<plugin filename=\"libgazebo_ros_diff_drive.so\" name=\"d\">" + keys +
                            "</plugin>" + more + "</gazebo>"));
    });
  };
  EXPECT_THAT(error("<left_joint/>"),
              AllOf(HasSubstr("<left_joint>"), HasSubstr("is empty: expected the name of a joint")));
  EXPECT_THAT(error("<wheelDiameter>0.1</wheelDiameter><wheelDiameter>0.1</wheelDiameter>"),
              AllOf(HasSubstr("<wheelDiameter>"), HasSubstr("stands there twice")));
  for (const char* value : {"0", "-0.38", "nan"}) {
    EXPECT_THAT(error(fmt::format("<wheel_separation>{}</wheel_separation>", value)),
                AllOf(HasSubstr("<wheel_separation>"), HasSubstr(value), HasSubstr("expected")));
  }
  EXPECT_THAT(error("", "\n<plugin filename=\"libgazebo_ros_diff_drive.so\" name=\"e\"/>"),
              HasSubstr("a second drive beside"));
}

TEST(RobotOriginErrors, GearsAndEncodersThatAreNone) {
  const auto error = [](const std::string& inside) {
    return input_error(
        [&] { from_urdf(sample_text("<ros2_control name=\"c\" type=\"system\">" + inside + "</ros2_control>")); });
  };
  const std::string joint = "<joint name=\"left_wheel_joint\">";
  for (const char* name : {"mechanicalReduction", "mechanical_reduction"}) {
    EXPECT_THAT(error(fmt::format("<transmission name=\"t\">{}<{}>0</{}></joint></transmission>", joint, name, name)),
                AllOf(HasSubstr(name), HasSubstr("0: expected motor turns per turn of the joint")));
  }
  for (const char* counts : {"0", "-4096"}) {
    EXPECT_THAT(error(fmt::format("<hardware><param name=\"enc_counts_per_rev\">{}</param></hardware>", counts)),
                AllOf(HasSubstr(counts), HasSubstr("expected counts of the encoder per turn, > 0")));
  }
}

TEST(RobotOriginErrors, NothingToMakeARobotOf) {
  EXPECT_THAT(input_error([&] { static_cast<void>(robot_from(nullptr, nullptr)); }),
              HasSubstr("no robot description and no controller: expected at least one"));
}

TEST(RobotOriginErrors, FilesOfAnotherKind) {
  EXPECT_THAT(
      urdf_error("<robot xmlns:xacro=\"x\" name=\"a\">\n<xacro:include filename=\"b\"/></robot>", "robot.urdf.xacro"),
      AllOf(HasSubstr("robot.urdf.xacro:2: <xacro:include> is xacro"), HasSubstr("expanded first")));
  EXPECT_THAT(urdf_error("<robot name=\"${n}\"/>", "a.urdf"), HasSubstr("a.urdf:1: '${n}' is xacro"));
  EXPECT_THAT(urdf_error("<sdf version=\"1.7\"/>", "a.urdf"), HasSubstr("is no URDF"));
  EXPECT_THAT(urdf_error("<robot>\n<link>", "a.urdf"), HasSubstr("a.urdf:2"));
  EXPECT_THAT(urdf_error("", "a.urdf"), HasSubstr("a.urdf:1"));
  EXPECT_THAT(urdf_error("<robot/><robot/>", "a.urdf"), HasSubstr("a second root element"));
}

TEST(RobotOriginErrors, LinksThatMakeNoTree) {
  EXPECT_THAT(refused("mast_joint", "<child link=\"mast\"/>", "<child link=\"left_wheel\"/>"),
              HasSubstr("joint 'left_wheel_joint': its child 'left_wheel' is that of"));
  EXPECT_THAT(refused("mast_joint", "<parent link=\"base_link\"/>", "<parent link=\"mast\"/>"),
              HasSubstr("ring of joints"));
  EXPECT_THAT(refused("mast_joint", "<parent link=\"base_link\"/>", "<parent link=\"base_lnk\"/>"),
              HasSubstr("did you mean 'base_link'?"));
  EXPECT_THAT(refused("<link", "<link name=\"base_footprint\"/>", "<link name=\"mast\"/>"),
              HasSubstr("has the name of robot.urdf:3"));
}

TEST(RobotOriginErrors, ControllersThatCannotBeUsed) {
  const auto refused_yaml = [](const std::string& from, const std::string& to) {
    return input_error([&] {
      const DriveFacts facts =
          parse_ros2_control(changed(testing::sample_controller, "controller_manager", from, to), "control.yaml");
      static_cast<void>(robot_from(nullptr, &facts));
    });
  };
  EXPECT_THAT(refused_yaml("wheel_radius: 0.05", "wheel_radius: 0.0"), HasSubstr("control.yaml:12: "));
  EXPECT_THAT(refused_yaml("wheel_radius: 0.05", "wheel_radius: five"), HasSubstr("wheel_radius: 'five'"));
  EXPECT_THAT(refused_yaml("wheel_radius: 0.05", "left_wheel_radius_multiplier: 1.1"),
              HasSubstr("left_wheel_radius_multiplier 1.1 against 1 of the other side"));
  EXPECT_THAT(refused_yaml("    wheel_radius: 0.05\n", ""), HasSubstr("give --wheel-radius"));
  EXPECT_THAT(refused_yaml("[\"left_wheel_joint\"]", "[a, b]"), HasSubstr("names 2 left and 1 right wheels"));
  EXPECT_THAT(refused_yaml("left_wheel_joint", "$(var prefix)left"), HasSubstr("put in by a launch file"));
  EXPECT_THAT(refused_yaml("    publish_rate: 50.0", "    linear: {x: {max_velocity: 1.0}}"),
              HasSubstr("dotted and nested"));
  EXPECT_THAT(yaml_error("a: {b: 1}\n", "c.yaml"), HasSubstr("c.yaml: no diff_drive_controller"));
  const std::string two = "one: {wheel_radius: 0.1}\ntwo: {wheel_radius: 0.2}\n";
  EXPECT_THAT(yaml_error(two, "c.yaml"), AllOf(HasSubstr("one, two"), HasSubstr("--controller NAME")));
  EXPECT_EQ(parse_ros2_control(two, "c.yaml", "two").wheel_radius->value, 0.2);
  EXPECT_THAT(yaml_error(two, "c.yaml", "tow"), HasSubstr("did you mean 'two'?"));
}

std::string mutated(std::string text, std::mt19937_64& random, const std::string& spice) {
  if (random() % 5 == 0) {
    text.resize(random() % (text.size() + 1));
  }
  for (std::uint64_t left = 1 + random() % 3; left > 0 && !text.empty(); --left) {
    const std::size_t at = random() % text.size();
    switch (random() % 5) {
      case 0: text[at] = static_cast<char>(random()); break;
      case 1: text.erase(at, 1 + random() % 12); break;
      case 2: text.insert(at, 1, spice[random() % spice.size()]); break;
      case 3: text.insert(at, text.substr(random() % text.size(), random() % 60)); break;
      default: text[at] = spice[random() % spice.size()];
    }
  }
  return text;
}

// Either a robot whose file reads back, or a message with the place: the file, and its line where the text has lines.
void fuzz(const std::string& good, const std::string& spice, const std::string& file, std::uint64_t seed,
          const std::function<RobotWithOrigins(const std::string&)>& read) {
  std::mt19937_64 random(seed);
  const std::regex place(file + "(:[0-9]+)?: ");
  int robots = 0, refusals = 0, lines = 0;
  for (int k = 0; k < 400; ++k) {
    const std::string text = mutated(good, random, spice);
    try {
      const RobotWithOrigins made = read(text);
      ASSERT_EQ(to_json(parse_robot(robot_yaml(made), "made.yaml")), to_json(made.robot)) << text;
      ++robots;
    } catch (const InputError& error) {
      std::smatch found;
      const std::string message = error.what();
      ASSERT_TRUE(std::regex_search(message, found, place)) << message << "\n" << text;
      lines += found[1].matched ? 1 : 0;
      ++refusals;
    }
  }
  EXPECT_GE(robots, 10);
  EXPECT_GT(refusals, 100);
  EXPECT_GT(lines, refusals / 2);
}

TEST(RobotOriginFuzz, Urdf) {
  fuzz(sample_text("<transmission name=\"t\"><joint name=\"left_wheel_joint\"/></transmission>\n"),
       "<>/\"'= -+.e0123456789na&;${}", "robot.urdf", 1, [](const std::string& text) { return from_urdf(text); });
}

TEST(RobotOriginFuzz, Controller) {
  fuzz(testing::sample_controller, ":{}[],\"'# \n-+.e0123456789na&*!|>%@", "control.yaml", 3,
       [](const std::string& text) {
         const DriveFacts facts = parse_ros2_control(text, "control.yaml");
         return robot_from(nullptr, &facts);
       });
}

}  // namespace
}  // namespace wheelwright::robots::robot_origin_errors_test

// SPDX-License-Identifier: Apache-2.0
// The language of .msg files, the bundled types, and directories of definitions.
#include <random>
#include <string>

#include "formats/logs/ros_messages.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::ros_definition_test {
namespace {

using ::testing::HasSubstr;
using testing::input_error;

TEST(RosDefinition, ReadsTheLanguage) {
  const auto definition = parse_ros_definition("pkg/Robot", R"(# a comment
uint8 MODE_OFF = 0   # a constant
string NAME='x # y'
float64 MASS=1.5
bool	ready		true
string<=10[<=4] labels ["a", "b"]
wstring wide
Wheel[2] wheels
geometry_msgs/msg/Pose pose   # bundled
int32[] counts [1, 2, 3]
================================================================================
MSG: pkg/Wheel
float32 speed 0.5
)");
  EXPECT_EQ(definition.name(), "pkg/msg/Robot");
  const auto& fields = definition.messages[0].fields;
  ASSERT_EQ(fields.size(), 6U);
  EXPECT_EQ(fields[0], (RosField{"ready", RosKind::boolean}));
  EXPECT_EQ(fields[1], (RosField{"labels", RosKind::string, RosShape::sequence, 4, 10}));
  EXPECT_EQ(fields[2], (RosField{"wide", RosKind::wstring}));
  EXPECT_EQ(fields[3].shape, RosShape::array);
  EXPECT_EQ(fields[3].count, 2U);
  EXPECT_EQ(definition.messages[fields[3].message].name, "pkg/msg/Wheel");
  EXPECT_EQ(definition.messages[fields[4].message].name, "geometry_msgs/msg/Pose");
  EXPECT_EQ(fields[5], (RosField{"counts", RosKind::int32, RosShape::sequence}));
}

TEST(RosDefinition, ErrorsNameTypeLineAndText) {
  const auto error = [](const std::string& text) {
    return input_error([&] { (void)parse_ros_definition("pkg/msg/A", text); });
  };
  EXPECT_THAT(error("float64 x\nflaot64 y\n"), HasSubstr("pkg/msg/A: line 2: 'flaot64 y'"));
  EXPECT_THAT(error("float64"), HasSubstr("line 1: 'float64': expected a type and a name"));
  EXPECT_THAT(error("float64[ x"), HasSubstr("expected a ']'"));
  EXPECT_THAT(error("float64[0] x"), HasSubstr("number of elements"));
  EXPECT_THAT(error("float64[99999999999] x"), HasSubstr("number of elements"));
  EXPECT_THAT(error("int8<=3 x"), HasSubstr("string<=N"));
  EXPECT_THAT(error("float64 x\nfloat64 x"), HasSubstr("not there twice"));
  EXPECT_THAT(error("a/b/c/d x"), HasSubstr("expected a type"));
  EXPECT_THAT(error("float64 x\n====\nnothing\n"), HasSubstr("line 3: 'nothing': expected 'MSG: pkg/Type'"));
  EXPECT_THAT(error("float64 x\n====\n"), HasSubstr("expected 'MSG: pkg/Type'"));
  EXPECT_THAT(error("B b\n====\nMSG: pkg/B\nA a\n"), HasSubstr("contain itself"));
  EXPECT_THAT(input_error([] { (void)parse_ros_definition("A", "float64 x"); }), HasSubstr("pkg/msg/Type"));
}

TEST(RosDefinition, NestingIsLimitedHoweverTheTypesAreOrdered) {
  std::string text = "T1 next\n";
  for (int k = 1; k < 100; ++k) {
    text += "====\nMSG: pkg/T" + std::to_string(k) + "\nT" + std::to_string(k + 1) + " next\n";
  }
  text += "====\nMSG: pkg/T100\nfloat64 x\n";
  EXPECT_THAT(input_error([&] { (void)parse_ros_definition("pkg/msg/T0", text); }), HasSubstr("32 deep"));
}

TEST(RosDefinition, TheTypeItselfMayStandBehindASeparator) {
  const auto definition = parse_ros_definition("pkg/msg/A", "====\nMSG: pkg/A\nfloat64 x\n");
  EXPECT_EQ(definition.messages[0].fields[0].name, "x");
  EXPECT_THAT(input_error([] { (void)parse_ros_definition("pkg/msg/A", "====\nIDL: pkg/msg/A\nmodule pkg {};\n"); }),
              HasSubstr("neither there nor bundled"));
}

TEST(RosDefinition, EmptyTypesHaveTheFieldThatTheyHaveOnTheWire) {
  const auto definition = parse_ros_definition("pkg/msg/A", "# nothing\n");
  ASSERT_EQ(definition.messages[0].fields.size(), 1U);
  EXPECT_EQ(definition.messages[0].fields[0].kind, RosKind::uint8);
}

// Found by the fuzzer of messages: the field was left out of the text for its name alone.
TEST(RosDefinition, AFieldNamedAsThatOfAnEmptyTypeStaysWhereItIsNone) {
  const std::string name = "structure_needs_at_least_one_member\n";
  for (const std::string& fields : {"float64 x\nuint8 " + name, "float64 " + name, "uint8[3] " + name}) {
    const auto definition = parse_ros_definition("a/msg/B", fields);
    EXPECT_EQ(ros_definition_text(definition), fields);
  }
  EXPECT_EQ(ros_definition_text(parse_ros_definition("a/msg/B", "uint8 " + name)), "");
}

TEST(RosDefinition, BundledTypesAreWholeAndReadBack) {
  for (const char* const name : {"sensor_msgs/msg/JointState",
                                 "sensor_msgs/Imu",
                                 "sensor_msgs/msg/BatteryState",
                                 "sensor_msgs/msg/Range",
                                 "sensor_msgs/msg/NavSatFix",
                                 "sensor_msgs/msg/MagneticField",
                                 "sensor_msgs/msg/Temperature",
                                 "sensor_msgs/msg/Joy",
                                 "nav_msgs/msg/Odometry",
                                 "nav_msgs/msg/Path",
                                 "tf2_msgs/msg/TFMessage",
                                 "control_msgs/msg/DynamicJointState",
                                 "control_msgs/msg/JointTrajectoryControllerState",
                                 "control_msgs/msg/InterfaceValue",
                                 "trajectory_msgs/msg/JointTrajectory",
                                 "geometry_msgs/msg/TwistStamped",
                                 "geometry_msgs/msg/AccelWithCovarianceStamped",
                                 "diagnostic_msgs/msg/DiagnosticArray",
                                 "std_msgs/msg/Empty",
                                 "std_msgs/msg/Float64MultiArray",
                                 "builtin_interfaces/msg/Duration",
                                 "rosgraph_msgs/msg/Clock"}) {
    const auto forms = bundled_ros_forms(name);
    ASSERT_FALSE(forms.empty()) << name;
    for (const RosDefinition& form : forms) {
      EXPECT_EQ(form.name(), full_ros_name(name));
      EXPECT_THAT(form.origin, HasSubstr("bundled"));
      EXPECT_EQ(parse_ros_definition(name, ros_definition_text(form)).messages, form.messages);
    }
  }
  EXPECT_FALSE(bundled_ros_definition("no_msgs/msg/Such"));
  EXPECT_EQ(bundled_ros_forms("control_msgs/msg/JointTrajectoryControllerState").size(), 3U);
}

class RosDefinitionFiles : public testing::ScratchTest {};

TEST_F(RosDefinitionFiles, FoundBelowADirectory) {
  std::filesystem::create_directories(path("share/pkg/msg"));
  std::filesystem::create_directories(path("share/other/msg"));
  put("share/pkg/msg/Robot.msg", "std_msgs/Header header\nother/Part[] parts\nEmpty nothing\n");
  put("share/pkg/msg/Empty.msg", "");
  put("share/other/msg/Part.msg", "float64 x\n");
  put("share/other/msg/Broken.msg", "float64 x\nfloat64\n");
  put("share/other/Part.msg", "not here");
  const auto definitions = ros_definitions_from(path("share"));
  EXPECT_TRUE(definitions.find("pkg/Empty"));
  const auto robot = definitions.find("pkg/Robot");
  ASSERT_TRUE(robot);
  EXPECT_EQ(robot->messages[robot->messages[0].fields[1].message].name, "other/msg/Part");
  EXPECT_THAT(robot->origin, HasSubstr("Robot.msg"));
  EXPECT_FALSE(definitions.find("pkg/Nothing"));
  EXPECT_THAT(input_error([&] { (void)definitions.find("other/Broken"); }), HasSubstr("Broken.msg: line 2: 'float64'"));
  EXPECT_TRUE(ros_definitions_from(path("share/pkg/msg")).find("pkg/msg/Empty"));
  EXPECT_THAT(input_error([&] { (void)ros_definitions_from(path("nowhere")); }), HasSubstr("nowhere: is no directory"));
  std::filesystem::create_directories(path("bare"));
  EXPECT_THAT(input_error([&] { (void)ros_definitions_from(path("bare")); }), HasSubstr("no message definition"));
}

TEST(RosDefinition, TextsChangedAtRandomAreReadOrRefused) {
  const std::string good = ros_definition_text(bundled_ros_definition("nav_msgs/msg/Odometry").value());
  std::mt19937_64 random(3);
  std::size_t refused = 0;
  for (int round = 0; round < 200; ++round) {
    std::string text = good;
    for (int change = 0; change < 3; ++change) {
      text[random() % text.size()] = static_cast<char>(random());
    }
    text.resize(random() % 2 == 0 ? text.size() : random() % text.size());
    try {
      EXPECT_FALSE(parse_ros_definition("nav_msgs/msg/Odometry", text).messages.empty());
    } catch (const InputError& error) {
      ++refused;
      EXPECT_THAT(error.what(), HasSubstr("nav_msgs/msg/Odometry"));
    }
  }
  EXPECT_GT(refused, 50U);
}

}  // namespace
}  // namespace wheelwright::logs::ros_definition_test

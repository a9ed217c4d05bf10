// SPDX-License-Identifier: Apache-2.0
// Numbers out of CDR: against bytes laid by hand, and against definitions and messages made at random.
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "formats/logs/bag_write.hpp"
#include "formats/logs/ros_messages.hpp"
#include "tests/logs/ros_cdr.hpp"
#include "tests/support/scratch.hpp"

namespace wheelwright::logs::ros_extractor_test {
namespace {

using testing::HandCdr;
using ::testing::HasSubstr;
using testing::input_error;

std::vector<double> read(const RosDefinition& definition, const std::vector<std::string>& paths, std::string_view cdr) {
  RosExtractor extractor(definition, paths);
  std::vector<double> values(paths.size(), -1.0);
  EXPECT_TRUE(extractor.read(cdr, values)) << extractor.error();
  return values;
}

std::string joint_state(bool little, const std::vector<std::string>& names) {
  HandCdr cdr(little);
  cdr.put(std::int32_t{1'700'000'000}).put(std::uint32_t{123'456'789}).put("base");
  return cdr.list(names)
      .list(std::vector<double>{1.5, -2.5})
      .list(std::vector<double>{0.25, std::numeric_limits<double>::infinity()})
      .list(std::vector<double>{})
      .str();
}

TEST(RosExtractor, JointStateInBothByteOrders) {
  const auto definition = bundled_ros_definition("sensor_msgs/JointState").value();
  for (const bool little : {true, false}) {
    RosExtractor extractor(definition, {"velocity[right]", "position[0]", "effort[left]", "position[left]",
                                        "header.stamp.nanosec", "velocity[7]", "velocity[nobody]"});
    std::vector<double> values(7);
    ASSERT_TRUE(extractor.read(joint_state(little, {"left", "right"}), values)) << extractor.error();
    EXPECT_EQ(values[0], std::numeric_limits<double>::infinity());
    EXPECT_EQ(values[1], 1.5);
    EXPECT_TRUE(std::isnan(values[2]));
    EXPECT_EQ(values[3], 1.5);
    EXPECT_EQ(values[4], 123'456'789.0);
    EXPECT_TRUE(std::isnan(values[5]));
    EXPECT_TRUE(std::isnan(values[6]));
    EXPECT_EQ(extractor.stamp(), 1'700'000'000'123'456'789);
    // Names are looked up in every message anew.
    ASSERT_TRUE(extractor.read(joint_state(little, {"right", "a longer name", "left"}), values)) << extractor.error();
    EXPECT_EQ(values[0], 0.25);
    EXPECT_TRUE(std::isnan(values[3]));
    EXPECT_EQ(read_names(definition, joint_state(little, {"right", "left"})),
              (std::vector<std::string>{"right", "left"}));
  }
}

TEST(RosExtractor, EveryKindAndNastyAlignment) {
  const auto definition = parse_ros_definition("a/msg/All", R"(
bool flag
float64 behind_one
int8 i8
uint16 u16
byte[3] three
int64 i64
string<=5 text
uint8 u8
float32[2] pair
char c
float64[] none
uint8 u
int16 i16
uint64[<=2] big
int32 i32
uint32 last
)");
  const std::vector<std::string> paths = {"flag", "behind_one", "i8", "u16", "three[1]", "i64", "u8",   "pair[1]",
                                          "c",    "none[0]",    "u",  "i16", "big[1]",   "i32", "last", "flag"};
  for (const bool little : {true, false}) {
    HandCdr cdr(little);
    cdr.put(std::uint8_t{1}).put(0.1).put(std::int8_t{-3}).put(std::uint16_t{65535});
    cdr.put(std::uint8_t{7}).put(std::uint8_t{8}).put(std::uint8_t{9}).put(std::int64_t{-5}).put("abcd");
    cdr.put(std::uint8_t{200}).put(1.0F).put(-0.5F).put(std::uint8_t{66}).list(std::vector<double>{});
    cdr.put(std::uint8_t{17}).put(std::int16_t{-300}).list(std::vector<std::uint64_t>{1, 1ULL << 63});
    cdr.put(std::int32_t{-70000}).put(std::uint32_t{4'000'000'000U});
    const auto values = read(definition, paths, cdr.str());
    const std::vector<double> expected = {
        1, 0.1, -3, 65535, 8, -5, 200, -0.5, 66, -1, 17, -300, std::ldexp(1.0, 63), -70000, 4'000'000'000.0, 1};
    for (std::size_t k = 0; k < expected.size(); ++k) {
      if (paths[k] == "none[0]") {
        EXPECT_TRUE(std::isnan(values[k]));
      } else {
        EXPECT_EQ(values[k], expected[k]) << paths[k];
      }
    }
  }
}

TEST(RosExtractor, ListsOfMessagesByIndexAndByName) {
  const auto definition = bundled_ros_definition("control_msgs/msg/DynamicJointState").value();
  HandCdr cdr(true);
  cdr.put(std::int32_t{0}).put(std::uint32_t{0}).put("");
  cdr.list(std::vector<std::string>{"left", "right"}).put(std::uint32_t{2});
  cdr.list(std::vector<std::string>{"velocity", "effort"}).list(std::vector<double>{1.0, 2.0});
  cdr.list(std::vector<std::string>{"effort"}).list(std::vector<double>{3.0});
  RosExtractor extractor(definition,
                         {"interface_values[right].values[effort]", "interface_values[left].values[effort]",
                          "interface_values[0].values[velocity]", "interface_values[right].values[velocity]",
                          "interface_values[1].values[0]", "interface_values[2].values[0]"});
  std::vector<double> values(6);
  ASSERT_TRUE(extractor.read(cdr.str(), values)) << extractor.error();
  EXPECT_EQ(values[0], 3.0);
  EXPECT_EQ(values[1], 2.0);
  EXPECT_EQ(values[2], 1.0);
  EXPECT_TRUE(std::isnan(values[3]));
  EXPECT_EQ(values[4], 3.0);
  EXPECT_TRUE(std::isnan(values[5]));
  EXPECT_FALSE(extractor.stamp());  // zero
}

TEST(RosExtractor, NamesMayStandAroundTheListOrBehindIt) {
  const auto around = bundled_ros_definition("trajectory_msgs/msg/JointTrajectory").value();
  HandCdr cdr(false);
  cdr.put(std::int32_t{5}).put(std::uint32_t{6}).put("x").list(std::vector<std::string>{"a", "b"});
  cdr.put(std::uint32_t{1}).list(std::vector<double>{1.0, 2.0}).list(std::vector<double>{3.0, 4.0});
  cdr.list(std::vector<double>{}).list(std::vector<double>{}).put(std::int32_t{-1}).put(std::uint32_t{5});
  EXPECT_EQ(read(around, {"points[0].velocities[b]", "points[0].time_from_start.sec"}, cdr.str()),
            (std::vector<double>{4.0, -1.0}));

  const auto behind = parse_ros_definition("a/msg/Behind", "float64[] speeds\nstring[] names\n");
  HandCdr other(true);
  other.list(std::vector<double>{7.0, 8.0}).list(std::vector<std::string>{"p", "q"});
  EXPECT_EQ(read(behind, {"speeds[q]"}, other.str()), std::vector<double>{8.0});

  const auto several = bundled_ros_definition("trajectory_msgs/MultiDOFJointTrajectory").value();
  EXPECT_NO_THROW(RosExtractor(several, {"points[2].velocities[base].angular.z"}));
}

TEST(RosExtractor, PathsThatLeadNowhereNameTheNearest) {
  const auto definition = bundled_ros_definition("nav_msgs/msg/Odometry").value();
  const auto error = [&](const std::string& path) {
    return input_error([&] { RosExtractor extractor(definition, {path}); });
  };
  EXPECT_THAT(error("twist.twist.angluar.z"), HasSubstr("'twist.twist.angluar.z'"));
  EXPECT_THAT(error("twist.twist.angluar.z"), HasSubstr("did you mean 'angular'?"));
  EXPECT_THAT(error("twist.twist.angluar.z"), HasSubstr("nav_msgs/msg/Odometry"));
  EXPECT_THAT(error("child_frame_id"), HasSubstr("is text"));
  EXPECT_THAT(error("pose.pose"), HasSubstr("pose.pose.position"));
  EXPECT_THAT(error("pose.covariance"), HasSubstr("covariance[0]"));
  EXPECT_THAT(error("pose.covariance[36]"), HasSubstr("at most 36"));
  EXPECT_THAT(error("pose.covariance[x]"), HasSubstr("joint_names"));
  EXPECT_THAT(error("pose[0].pose.position.x"), HasSubstr("is no list"));
  EXPECT_THAT(error("pose.pose.position.x.y"), HasSubstr("has no fields"));
  EXPECT_THAT(error(""), HasSubstr("has no field"));
  EXPECT_THAT(error("pose.covariance[0"), HasSubstr("is a list"));
}

TEST(RosExtractor, NumericPathsCanBeRead) {
  const auto paths = numeric_paths(bundled_ros_definition("nav_msgs/Path").value());
  EXPECT_THAT(paths, ::testing::Contains("poses[].pose.position.x"));
  EXPECT_THAT(paths, ::testing::Contains("header.stamp.sec"));
  EXPECT_THAT(paths, ::testing::Not(::testing::Contains("header.frame_id")));
}

TEST(RosExtractor, EveryShorterMessageIsRefused) {
  const auto definition = bundled_ros_definition("sensor_msgs/JointState").value();
  RosExtractor extractor(definition, {"velocity[right]"});
  const std::string whole = joint_state(true, {"left", "right"});
  std::array<double, 1> value{};
  ASSERT_TRUE(extractor.read(whole, value));
  for (std::size_t length = 0; length < whole.size(); ++length) {
    const std::string cut = whole.substr(0, length);  // its own memory: reading beyond it is seen by sanitizers
    ASSERT_FALSE(extractor.read(cut, value)) << length;
    EXPECT_TRUE(std::isnan(value[0]));
    EXPECT_FALSE(extractor.stamp());
    EXPECT_FALSE(extractor.error().empty());
  }
  EXPECT_TRUE(extractor.read(whole + std::string(3, '\0'), value));
  EXPECT_FALSE(extractor.read(whole + std::string(4, '\0'), value));
  EXPECT_THAT(extractor.error(), HasSubstr("4 bytes are left"));
  EXPECT_TRUE(extractor.read(whole, value));
  EXPECT_TRUE(extractor.error().empty());
}

TEST(RosExtractor, AnotherFormOfTheTypeIsSaidInsteadOfRead) {
  const auto forms = bundled_ros_forms("sensor_msgs/msg/Range");
  ASSERT_EQ(forms.size(), 2U);
  HandCdr cdr(true);
  cdr.put(std::int32_t{1}).put(std::uint32_t{2}).put("f").put(std::uint8_t{0});
  cdr.put(0.1F).put(0.2F).put(5.0F).put(1.5F).put(0.01F);
  std::array<double, 1> value{};
  RosExtractor humble(forms[0], {"range"}), jazzy(forms[1], {"range"});
  EXPECT_FALSE(humble.read(cdr.str(), value));
  EXPECT_TRUE(jazzy.read(cdr.str(), value));
  EXPECT_EQ(value[0], 1.5);
}

TEST(RosExtractor, AListThatClaimsTooMuchIsRefusedAtOnce) {
  const auto definition = parse_ros_definition("a/msg/Deep", "a/B[] b\n===\nMSG: a/B\na/C[] c\n===\nMSG: a/C\n");
  HandCdr cdr(true);
  cdr.put(std::uint32_t{0xFFFFFFFF}).put(std::uint32_t{0xFFFFFFFF}).put(std::uint64_t{0});
  RosExtractor extractor(definition, {"b[4000000000].c[3].structure_needs_at_least_one_member"});
  std::array<double, 1> value{};
  EXPECT_FALSE(extractor.read(cdr.str(), value));
  EXPECT_THAT(extractor.error(), HasSubstr("4294967295 elements"));
}

TEST(RosExtractor, BehindAWideStringNothingIsRead) {
  const auto definition = parse_ros_definition("a/msg/W", "float64 before\nwstring text\nfloat64 behind\n");
  EXPECT_THAT(input_error([&] { RosExtractor extractor(definition, {"behind"}); }), HasSubstr("wstring"));
  HandCdr cdr(true);
  cdr.put(4.5).put(std::uint32_t{1}).put(std::uint32_t{65}).put(2.0);
  EXPECT_EQ(read(definition, {"before"}, cdr.str()), std::vector<double>{4.5});
}

TEST(RosExtractor, NotOtherwiseEncodedBytes) {
  RosExtractor extractor(bundled_ros_definition("std_msgs/Float64").value(), {"data"});
  std::array<double, 1> value{};
  EXPECT_FALSE(extractor.read(std::string("\0\3\0\0\0\0\0\0\0\0\0\0", 12), value));
  EXPECT_THAT(extractor.error(), HasSubstr("00 03"));
  EXPECT_FALSE(extractor.read("{\"data\": 1}", value));
}

/// A type made at random, a message of it, and the numbers in it.
class RandomMessage {
 public:
  explicit RandomMessage(std::uint64_t seed) : random_(seed), cdr_(seed % 2 == 0) {
    for (std::size_t type = 0; type < types; ++type) {
      std::string text;
      const std::size_t fields = 1 + pick(5);
      for (std::size_t field = 0; field < fields; ++field) {
        fields_[type].push_back(make_field(type, field));
        text += fields_[type].back().text + "\n";
      }
      text_ = type == 0 ? text : text_ + "=====\nMSG: r/T" + std::to_string(type) + "\n" + text;
    }
    encode(0, "");
  }

  [[nodiscard]] const std::string& text() const { return text_; }
  [[nodiscard]] const std::string& bytes() const { return cdr_.str(); }

  std::vector<std::string> paths;
  std::vector<double> values;

 private:
  static constexpr std::size_t types = 4;

  struct Field {
    std::string name, text;
    std::size_t kind;  ///< index of a primitive, or 12 + a type
    int shape;         ///< 0 single, 1 array of 3, 2 sequence
  };

  std::size_t pick(std::size_t below) { return std::uniform_int_distribution<std::size_t>(0, below - 1)(random_); }

  Field make_field(std::size_t type, std::size_t number) {
    static const std::vector<std::string> words = {"bool",   "int8",  "uint8",  "int16",   "uint16",  "int32",
                                                   "uint32", "int64", "uint64", "float32", "float64", "string"};
    Field field;
    field.name = "f" + std::to_string(number);
    field.kind = pick(words.size() + (type + 1 < types ? 4 : 0));
    if (field.kind >= words.size()) {
      field.kind = words.size() + type + 1 + pick(types - type - 1);
    }
    field.shape = static_cast<int>(pick(3));
    field.text = (field.kind < words.size() ? words[field.kind] : "r/T" + std::to_string(field.kind - words.size())) +
                 (field.shape == 0   ? ""
                  : field.shape == 1 ? "[3]"
                                     : "[]") +
                 " " + field.name;
    return field;
  }

  template <typename Number>
  void number(const std::string& path, Number value) {
    cdr_.put(value);
    paths.push_back(path);
    values.push_back(static_cast<double>(value));
  }

  void element(const Field& field, const std::string& path) {
    const std::uint64_t bits = random_();
    switch (field.kind) {
      case 0: number(path, static_cast<std::uint8_t>(bits & 1)); break;
      case 1: number(path, static_cast<std::int8_t>(bits)); break;
      case 2: number(path, static_cast<std::uint8_t>(bits)); break;
      case 3: number(path, static_cast<std::int16_t>(bits)); break;
      case 4: number(path, static_cast<std::uint16_t>(bits)); break;
      case 5: number(path, static_cast<std::int32_t>(bits)); break;
      case 6: number(path, static_cast<std::uint32_t>(bits)); break;
      case 7: number(path, static_cast<std::int64_t>(bits)); break;
      case 8: number(path, bits); break;
      case 9: number(path, static_cast<float>(bits % 1000) / 8.0F); break;
      case 10: number(path, static_cast<double>(bits) * 1e-9); break;
      case 11: cdr_.put(std::string(bits % 9, 'x')); break;
      default: encode(field.kind - 12, path + ".");
    }
  }

  void encode(std::size_t type, const std::string& before) {
    for (const Field& field : fields_[type]) {
      const std::size_t count = field.shape == 0 ? 1 : field.shape == 1 ? 3 : pick(3);
      if (field.shape == 2) {
        cdr_.put(static_cast<std::uint32_t>(count));
      }
      for (std::size_t k = 0; k < count; ++k) {
        element(field, before + field.name + (field.shape == 0 ? "" : "[" + std::to_string(k) + "]"));
      }
    }
  }

  std::mt19937_64 random_;
  std::array<std::vector<Field>, types> fields_;
  std::string text_;
  HandCdr cdr_;
};

TEST(RosExtractor, DefinitionsAndMessagesMadeAtRandom) {
  std::size_t numbers = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const RandomMessage message(seed);
    const auto definition = parse_ros_definition("r/T0", message.text());
    ASSERT_EQ(read(definition, message.paths, message.bytes()), message.values) << message.text();
    // One path at a time walks another way through the same bytes.
    for (std::size_t k = 0; k < message.paths.size(); k += 7) {
      ASSERT_EQ(read(definition, {message.paths[k]}, message.bytes())[0], message.values[k]) << message.paths[k];
    }
    const auto again = parse_ros_definition("r/T0", ros_definition_text(definition));
    ASSERT_EQ(again.messages, definition.messages);
    numbers += message.paths.size();
  }
  EXPECT_GT(numbers, 2000U);
}

TEST(RosExtractor, MessagesChangedAtRandom) {
  std::mt19937_64 random(11);
  std::size_t refused = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const RandomMessage message(seed);
    RosExtractor extractor(parse_ros_definition("r/T0", message.text()), message.paths);
    std::vector<double> values(message.paths.size());
    std::string bytes = message.bytes();
    for (int change = 0; change < 3; ++change) {
      bytes[random() % bytes.size()] = static_cast<char>(random());
    }
    bytes.resize(random() % 2 == 0 ? bytes.size() : random() % (bytes.size() + 1));
    const bool whole = extractor.read(std::string(bytes), values);
    ASSERT_NE(whole, !extractor.error().empty());
    refused += whole ? 0 : 1;
  }
  EXPECT_GT(refused, 50U);
}

// ---- Writing: Fast-CDR's bytes are those laid by hand ----

RosHeader header(std::int64_t stamp, const char* frame) {
  RosHeader own;
  own.stamp = stamp;
  own.frame_id = frame;
  return own;
}

TEST(RosEncoder, JointStateIsAsLaidByHand) {
  RosEncoder encoder;
  RosJointState message;
  message.header = header(1'700'000'000'123'456'789, "base");
  message.name = {"left", "right"};
  message.position = {1.5, -2.5};
  message.velocity = {0.25, std::numeric_limits<double>::infinity()};
  for (int again = 0; again < 2; ++again) {
    const std::string_view bytes = encoder.encode(message);
    RosExtractor extractor(bundled_ros_definition(RosJointState::type).value(), {"velocity[left]"});
    std::array<double, 1> value{};
    ASSERT_TRUE(extractor.read(bytes, value)) << extractor.error();
    EXPECT_EQ(value[0], 0.25);
    EXPECT_EQ(bytes.size(), joint_state(true, {"left", "right"}).size());
  }
}

TEST(RosEncoder, EveryFieldComesBack) {
  RosEncoder encoder;
  RosOdometry odometry;
  odometry.header = header(5'000'000'007, "odom");
  odometry.child_frame_id = "base_link";
  odometry.pose = {{1, 2, 3}, {4, 5, 6, 7}};
  odometry.twist = {{8, 9, 10}, {11, 12, 13}};
  odometry.pose_covariance[35] = 14;
  odometry.twist_covariance[0] = 15;
  EXPECT_EQ(read(bundled_ros_definition(RosOdometry::type).value(),
                 {"header.stamp.sec", "header.stamp.nanosec", "pose.pose.position.x", "pose.pose.orientation.w",
                  "pose.covariance[35]", "twist.twist.linear.y", "twist.twist.angular.z", "twist.covariance[0]"},
                 encoder.encode(odometry)),
            (std::vector<double>{5, 7, 1, 7, 14, 9, 13, 15}));
  RosPoseStamped pose;
  pose.header = header(1, "map");
  pose.pose = odometry.pose;
  EXPECT_EQ(read(bundled_ros_definition(RosPoseStamped::type).value(), {"pose.position.z", "pose.orientation.x"},
                 encoder.encode(pose)),
            (std::vector<double>{3, 4}));
  RosTwistStamped twist;
  twist.header = header(1, "base");
  twist.twist = odometry.twist;
  EXPECT_EQ(read(bundled_ros_definition(RosTwistStamped::type).value(), {"twist.linear.x", "twist.angular.z"},
                 encoder.encode(twist)),
            (std::vector<double>{8, 13}));
  RosImu imu;
  imu.angular_velocity = {1, 2, 3};
  imu.linear_acceleration = {4, 5, 6};
  imu.linear_acceleration_covariance[8] = 7;
  EXPECT_EQ(read(bundled_ros_definition(RosImu::type).value(),
                 {"angular_velocity.z", "linear_acceleration.x", "linear_acceleration_covariance[8]",
                  "orientation_covariance[0]"},
                 encoder.encode(imu)),
            (std::vector<double>{3, 4, 7, -1}));
  const auto columns = parse_ros_definition(RosColumns::type, columns_definition({"omega_r", "rho"}));
  RosExtractor extractor(columns, {"rho", "omega_r"});
  std::array<double, 2> values{};
  RosColumns row;
  row.header.stamp = 42;
  row.values = {1.25, -3.5};
  ASSERT_TRUE(extractor.read(encoder.encode(row), values)) << extractor.error();
  EXPECT_EQ(values[0], -3.5);
  EXPECT_EQ(values[1], 1.25);
  EXPECT_EQ(extractor.stamp(), 42);
  row.header.stamp = -1;
  EXPECT_THROW(encoder.encode(row), InvalidArgument);
  EXPECT_THROW(columns_definition({"a", "a"}), InvalidArgument);
  EXPECT_THROW(columns_definition({"header"}), InvalidArgument);
}

// Bytes between fields held what the memory had: recordings of equal messages were not equal.
TEST(RosEncoder, WhatLiesBetweenFieldsIsZero) {
  const RosColumns before{{1'000'000'000, std::string(40, 'x')}, std::vector<double>(30, -1.0 / 3.0)};
  const RosColumns message{{5, "abcd"}, {1.0, 2.0}};
  RosEncoder used, fresh;
  EXPECT_EQ(used.encode(before).size(), 4 + 8 + 4 + 41 + 3 + 240u);
  const std::string bytes(used.encode(message));
  EXPECT_EQ(bytes, std::string(fresh.encode(message)));
  // Behind 4 bytes: a stamp of 8, a length of 4 and "abcd" with its end make 17, and doubles begin at 24.
  EXPECT_EQ(bytes.substr(4 + 17, 7), std::string(7, '\0'));
}

TEST(RosEncoder, FieldNames) {
  EXPECT_EQ(ros_field_name("rho.lower bound"), "rho_lower_bound");
  EXPECT_EQ(ros_field_name("__Omega__R_"), "omega_r");
  EXPECT_EQ(ros_field_name("2nd"), "column_2nd");
  EXPECT_EQ(ros_field_name("µ"), "column");
  EXPECT_EQ(ros_field_name(ros_field_name("A-b")), ros_field_name("A-b"));
}

}  // namespace
}  // namespace wheelwright::logs::ros_extractor_test

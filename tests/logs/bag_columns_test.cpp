// SPDX-License-Identifier: Apache-2.0
#include <deque>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.hpp"
#include "formats/logs/bag_log.hpp"

namespace wheelwright::logs::bag_columns_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

// Topics of a bag and what their first messages name.
class Bag {
 public:
  void add(const std::string& name, const std::string& type, std::vector<std::string> names = {},
           std::vector<std::string> filled = {}) {
    BagTopic topic;
    topic.name = name;
    topic.type = type;
    topic.encoding = "cdr";
    if (auto definition = bundled_ros_definition(type)) {
      topic.definition = std::make_shared<const RosDefinition>(*std::move(definition));
    }
    topics_.push_back(std::move(topic));
    views_.push_back({nullptr, false, std::move(names), std::move(filled)});
  }
  void define(const std::string& name, const std::string& type, const std::string& text) {
    add(name, type);
    topics_.back().definition = std::make_shared<const RosDefinition>(parse_ros_definition(type, text));
  }

  BagChoice choose(const CsvOptions& options = {}) {
    for (std::size_t k = 0; k < views_.size(); ++k) {
      views_[k].topic = &topics_[k];
    }
    return choose_bag_columns(views_, options, "my.mcap");
  }

  // Column -> "topic.field".
  std::map<std::string, std::string> places(const CsvOptions& options = {}) {
    std::map<std::string, std::string> found;
    for (const BagSource& source : choose(options).sources) {
      for (const BagColumn& column : source.columns) {
        found[column.name] = topics_[source.topic].name + "." + column.fields.front() + (column.is_yaw() ? " yaw" : "");
      }
    }
    return found;
  }

 private:
  std::deque<BagTopic> topics_;
  std::vector<BagTopicView> views_;
};

const std::vector<std::string> all_arrays = {"position", "velocity", "effort"};
using Places = std::map<std::string, std::string>;

TEST(BagColumns, WheelsAreFoundByTheNamesOfTheirJoints) {
  for (const auto& [right, left] : {std::pair("right_wheel", "left_wheel"),
                                    {"wheel_right_joint", "wheel_left_joint"},
                                    {"wheel_r", "wheel_l"},
                                    {"RightWheel", "LeftWheel"},
                                    {"base/r_wheel_joint", "base/l_wheel_joint"},
                                    {"rightwheel", "leftwheel"}}) {
    Bag bag;
    bag.add("/joint_states", "sensor_msgs/msg/JointState", {left, "arm_left_elbow", right, "caster"}, all_arrays);
    const std::string at = std::string("[") + right + "]";
    const Places found = bag.places();
    EXPECT_EQ(found.size(), 6U) << right;
    EXPECT_EQ(found.at("omega_r"), "/joint_states.velocity" + at);
    EXPECT_EQ(found.at("tau_r"), "/joint_states.effort" + at);
    EXPECT_EQ(found.at("phi_l"), std::string("/joint_states.position[") + left + "]");
  }
}

TEST(BagColumns, ArraysThatAreNotFilledAreNoColumns) {
  Bag bag;
  bag.add("/joint_states", "sensor_msgs/msg/JointState", {"right", "left"}, {"velocity"});
  EXPECT_EQ(bag.places(),
            (Places{{"omega_r", "/joint_states.velocity[right]"}, {"omega_l", "/joint_states.velocity[left]"}}));
}

TEST(BagColumns, FourWheelsAreTwoSidesAndItIsSaid) {
  Bag bag;
  bag.add("/joint_states", "sensor_msgs/msg/JointState",
          {"front_left_wheel", "front_right_wheel", "rear_left_wheel", "rear_right_wheel", "left_caster_wheel"},
          all_arrays);
  const BagChoice choice = bag.choose();
  ASSERT_EQ(choice.sources.size(), 1U);
  EXPECT_THAT(
      choice.sources[0].columns,
      Contains(BagColumn{"tau_r", {"effort[front_right_wheel]", "effort[rear_right_wheel]"}, BagColumn::Rule::sum}));
  EXPECT_THAT(choice.sources[0].columns,
              Contains(BagColumn{
                  "omega_l", {"velocity[front_left_wheel]", "velocity[rear_left_wheel]"}, BagColumn::Rule::mean}));
  EXPECT_THAT(choice.notes, Contains(HasSubstr("the right side is the mean motion and the sum of the efforts of "
                                               "front_right_wheel and rear_right_wheel")));
}

TEST(BagColumns, JointsOfSeveralTopicsGiveTheirSide) {
  Bag bag;
  bag.add("/left/joint_states", "sensor_msgs/msg/JointState", {"wheel"}, {"velocity"});
  bag.add("/motors/b", "sensor_msgs/msg/JointState", {"right_wheel"}, {"velocity"});
  const Places found = bag.places();
  EXPECT_EQ(found.at("omega_l"), "/left/joint_states.velocity[wheel]");
  EXPECT_EQ(found.at("omega_r"), "/motors/b.velocity[right_wheel]");
}

TEST(BagColumns, SeveralJointsASideThatAreNoWheelsAreNotGuessed) {
  Bag bag;
  bag.add("/joint_states", "sensor_msgs/msg/JointState", {"left_hip", "left_knee", "right_hip", "right_knee"},
          all_arrays);
  const BagChoice choice = bag.choose();
  EXPECT_THAT(choice.sources, IsEmpty());
  EXPECT_THAT(choice.notes, Contains(HasSubstr("has 2 right joints (right_hip, right_knee): none was taken; "
                                               "--map omega_r=/joint_states.velocity[right_hip]")));
}

TEST(BagColumns, OneJointIsAnAxis) {
  Bag bag;
  bag.add("/axis", "sensor_msgs/msg/JointState", {"slide"}, all_arrays);
  EXPECT_EQ(bag.places(), (Places{{"position", "/axis.position[slide]"},
                                  {"velocity", "/axis.velocity[slide]"},
                                  {"effort", "/axis.effort[slide]"}}));
}

// Rows were interpolated, and dropped, for the sake of a gripper.
TEST(BagColumns, AJointBesideWheelsIsAskedForOrLeftOut) {
  Bag bag;
  bag.add("/joint_states", "sensor_msgs/msg/JointState", {"right_wheel", "left_wheel"}, {"velocity"});
  bag.add("/gripper/joint_states", "sensor_msgs/msg/JointState", {"finger"}, all_arrays);
  const Places wheels = {{"omega_r", "/joint_states.velocity[right_wheel]"},
                         {"omega_l", "/joint_states.velocity[left_wheel]"}};
  EXPECT_EQ(bag.places(), wheels);
  EXPECT_THAT(bag.choose().notes,
              ElementsAre(HasSubstr("/gripper/joint_states is of one axis, by its name no wheel, and was left out: "
                                    "--map position=/gripper/joint_states.position[finger] takes it")));
  CsvOptions options;
  options.only = {"position"};
  EXPECT_EQ(bag.places(options), (Places{{"position", "/gripper/joint_states.position[finger]"}}));
  options.only.reset();
  options.map["effort"] = "/gripper/joint_states.effort[finger]";
  Places both = wheels;
  both["effort"] = "/gripper/joint_states.effort[finger]";
  EXPECT_EQ(bag.places(options), both);
}

TEST(BagColumns, WheelsWithATopicEachAreNoOtherAxes) {
  Bag bag;
  bag.add("/right_wheel", "sensor_msgs/msg/JointState", {"joint"}, {"velocity"});
  EXPECT_EQ(bag.places(),
            (Places{{"velocity", "/right_wheel.velocity[joint]"}, {"omega_r", "/right_wheel.velocity[joint]"}}))
      << "a test stand of one wheel";
  bag.add("/left_wheel", "sensor_msgs/msg/JointState", {"joint"}, {"velocity"});
  EXPECT_EQ(bag.places(),
            (Places{{"omega_r", "/right_wheel.velocity[joint]"}, {"omega_l", "/left_wheel.velocity[joint]"}}));
  EXPECT_THAT(bag.choose().notes, IsEmpty());
}

TEST(BagColumns, APoseOfItsOwnGoesBeforeOdometryAndWheelOdometryIsLeftOut) {
  Bag bag;
  bag.add("/diff_drive_controller/odom", "nav_msgs/msg/Odometry");
  EXPECT_THAT(bag.choose().sources, IsEmpty());
  EXPECT_THAT(bag.choose().notes,
              Contains(HasSubstr("/diff_drive_controller/odom (nav_msgs/msg/Odometry) was not taken")));
  bag.add("/odom", "nav_msgs/msg/Odometry");
  EXPECT_EQ(bag.places().at("theta"), "/odom.pose.pose.orientation.x yaw");
  bag.add("/mocap/pose", "geometry_msgs/msg/PoseStamped");
  EXPECT_EQ(bag.places(), (Places{{"x", "/mocap/pose.pose.position.x"},
                                  {"y", "/mocap/pose.pose.position.y"},
                                  {"theta", "/mocap/pose.pose.orientation.x yaw"}}));
}

TEST(BagColumns, OfTwoEqualTopicsNoneIsTaken) {
  Bag bag;
  bag.add("/imu/a", "sensor_msgs/msg/Imu");
  bag.add("/imu/b", "sensor_msgs/msg/Imu");
  const BagChoice choice = bag.choose();
  EXPECT_THAT(choice.sources, IsEmpty());
  EXPECT_THAT(choice.notes, Contains(HasSubstr("gyro_z was left out since several topics have it (/imu/a, /imu/b): "
                                               "--map gyro_z=/imu/a.angular_velocity.z takes one")));
  CsvOptions options;
  options.map = {{"gyro_z", "/imu/b.angular_velocity.z"}, {"accel_x", "/imu/b.linear_acceleration.x"}};
  EXPECT_EQ(bag.places(options).at("gyro_z"), "/imu/b.angular_velocity.z");
}

TEST(BagColumns, FieldsOfOwnTypesAreTakenByTheirNamesButThoseOfRosAreNot) {
  Bag bag;
  bag.define("/drive", "my_msgs/msg/Drive",
             "std_msgs/Header header\nfloat32 omega_r\nfloat32 left_omega\nfloat32[2] tau_r\n"
             "int16 speed_of_sound\n");
  bag.add("/cmd_vel", "geometry_msgs/msg/Twist");
  bag.add("/point", "geometry_msgs/msg/Point");
  EXPECT_EQ(bag.places(), (Places{{"omega_r", "/drive.omega_r"}, {"omega_l", "/drive.left_omega"}}));
}

TEST(BagColumns, TheMapTakesAnyNumberOfTheLongestTopicThatFits) {
  Bag bag;
  bag.add("/a", "geometry_msgs/msg/Twist");
  bag.add("/a.b", "std_msgs/msg/Float64");
  bag.add("/odom", "nav_msgs/msg/Odometry");
  CsvOptions options;
  options.only = {{"omega_r"}};
  options.map = {{"omega_r", "/a.b.data"}, {"omega_l", "/a.angular.z"}, {"theta", "/odom.pose.pose.orientation.yaw"}};
  EXPECT_EQ(
      bag.places(options),
      (Places{{"omega_r", "/a.b.data"}, {"omega_l", "/a.angular.z"}, {"theta", "/odom.pose.pose.orientation.x yaw"}}));
  options.map = {{"omega_r", "/c.data"}};
  EXPECT_THROW(
      {
        try {
          bag.choose(options);
        } catch (const InputError& error) {
          EXPECT_THAT(error.what(), HasSubstr("my.mcap: --map omega_r=/c.data: no topic begins this field"));
          EXPECT_THAT(error.what(), HasSubstr("/a, /a.b, /odom"));
          throw;
        }
      },
      InputError);
}

TEST(BagColumns, AMapToMessagesWithoutADefinitionIsAnError) {
  Bag bag;
  bag.add("/drive", "my_robot/msg/Drive");
  bag.add("/odom", "nav_msgs/msg/Odometry");
  CsvOptions options;
  EXPECT_NO_THROW(bag.choose(options));
  options.map = {{"omega_r", "/drive.speed"}};
  try {
    bag.choose(options);
    FAIL() << "nothing was thrown";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), HasSubstr("my.mcap: --map omega_r=/drive.speed: the messages of /drive "
                                        "(my_robot/msg/Drive) cannot be read"));
  }
}

TEST(BagColumns, AnElementThatNoMessageNamesIsAnError) {
  Bag bag;
  bag.add("/joint_states", "sensor_msgs/msg/JointState", {"right_wheel", "left_wheel"}, all_arrays);
  CsvOptions options;
  options.map = {{"omega_r", "/joint_states.velocity[right_whel]"}};
  try {
    bag.choose(options);
    FAIL() << "nothing was thrown";
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(),
                HasSubstr("the messages name no 'right_whel': expected one of right_wheel, left_wheel; did "
                          "you mean 'right_wheel'?"));
  }
  options.map = {{"omega_r", "/joint_states.velocity[1]"}};
  EXPECT_EQ(bag.places(options).at("omega_r"), "/joint_states.velocity[1]");
}

TEST(BagColumns, RowsHaveTheTimesOfTheEfforts) {
  Bag bag;
  bag.add("/pose", "geometry_msgs/msg/PoseStamped");
  bag.define("/efforts", "my_msgs/msg/Efforts", "float64 tau_r\nfloat64 tau_l\n");
  bag.add("/joint_states", "sensor_msgs/msg/JointState", {"right", "left"}, {"position", "velocity"});
  const BagChoice choice = bag.choose();
  std::vector<std::size_t> order;
  for (const BagSource& source : choice.sources) {
    order.push_back(source.topic);
  }
  EXPECT_THAT(order, ElementsAre(1U, 2U, 0U));
}

TEST(SideOfJoint, IsAWordOfTheNameAndNeverBoth) {
  EXPECT_EQ(side_of_joint("wheel_right_joint"), "r");
  EXPECT_EQ(side_of_joint("motorL"), "l");
  EXPECT_EQ(side_of_joint("roller"), "");
  EXPECT_EQ(side_of_joint("left_to_right_link"), "");
  EXPECT_EQ(side_of_joint(""), "");
}

TEST(BagColumns, WhatWasWishedForIsNoMeasurement) {
  Bag bag;
  bag.add("/goal_pose", "geometry_msgs/msg/PoseStamped");
  bag.add("/odom", "nav_msgs/msg/Odometry");
  bag.add("/joint_command", "sensor_msgs/msg/JointState", {"left_wheel", "right_wheel"}, {"velocity"});
  bag.add("/joint_states", "sensor_msgs/msg/JointState", {"left_wheel", "right_wheel"}, {"position"});
  const auto places = bag.places();
  EXPECT_EQ(places.at("x"), "/odom.pose.pose.position.x");
  EXPECT_EQ(places.at("phi_r"), "/joint_states.position[right_wheel]");
  EXPECT_FALSE(places.contains("omega_r"));
  EXPECT_THAT(bag.choose().notes, Contains(HasSubstr("/goal_pose")));
  EXPECT_THAT(bag.choose().notes, Contains(HasSubstr("/joint_command")));
}

TEST(BagColumns, FingersAreNoWheels) {
  Bag bag;
  bag.add("/joint_states", "sensor_msgs/msg/JointState", {"left_wheel", "right_wheel"}, {"velocity"});
  bag.add("/gripper", "sensor_msgs/msg/JointState", {"left_finger", "right_finger"}, {"effort"});
  bag.add("/drives", "sensor_msgs/msg/JointState", {"left_motor", "right_motor"}, {"position"});
  const auto places = bag.places();
  EXPECT_FALSE(places.contains("tau_r"));
  EXPECT_EQ(places.at("phi_r"), "/drives.position[right_motor]");
  EXPECT_THAT(bag.choose().notes, Contains(HasSubstr("--map tau_r=/gripper.effort[right_finger]")));
}

TEST(BagColumns, AWheelOfNoSideLeavesNoSumOfTheOthers) {
  Bag bag;
  bag.add("/joint_states", "sensor_msgs/msg/JointState", {"f_l_wheel", "f_r_wheel", "r_l_wheel", "r_r_wheel"},
          {"effort"});
  EXPECT_THAT(bag.choose().sources, IsEmpty());
  EXPECT_THAT(bag.choose().notes, Contains(HasSubstr("r_l_wheel")));
}

TEST(BagColumns, APoseThatWasPassedOverIsSaid) {
  Bag bag;
  bag.add("/amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped");
  bag.add("/odom", "nav_msgs/msg/Odometry");
  EXPECT_EQ(bag.places().at("x"), "/amcl_pose.pose.pose.position.x");
  EXPECT_THAT(bag.choose().notes, Contains(HasSubstr("x of /amcl_pose was taken before that of /odom")));
}

}  // namespace
}  // namespace wheelwright::logs::bag_columns_test

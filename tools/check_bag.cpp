// SPDX-License-Identifier: Apache-2.0
// One side of tools/check_bag.sh: messages of ROS 2 by Wheelwright.
//
//   check_bag types         the definition of every bundled type that the check takes, as JSON
//   check_bag write FILE    writes messages of the types that Wheelwright writes
//   check_bag read FILE     every number of every message on a line, as check_bag.mjs prints it
#include <bit>
#include <cmath>
#include <cstdio>
#include <exception>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "core/error.hpp"
#include "formats/logs/bag.hpp"
#include "formats/logs/bag_write.hpp"
#include "formats/logs/ros_messages.hpp"

namespace {

using namespace wheelwright;

constexpr const char* types[] = {"sensor_msgs/msg/JointState",
                                 "sensor_msgs/msg/Imu",
                                 "sensor_msgs/msg/BatteryState",
                                 "sensor_msgs/msg/Range",
                                 "sensor_msgs/msg/NavSatFix",
                                 "sensor_msgs/msg/Joy",
                                 "sensor_msgs/msg/LaserScan",
                                 "nav_msgs/msg/Odometry",
                                 "nav_msgs/msg/Path",
                                 "tf2_msgs/msg/TFMessage",
                                 "trajectory_msgs/msg/MultiDOFJointTrajectory",
                                 "control_msgs/msg/DynamicJointState",
                                 "control_msgs/msg/JointTrajectoryControllerState",
                                 "diagnostic_msgs/msg/DiagnosticArray",
                                 "geometry_msgs/msg/TransformStamped",
                                 "std_msgs/msg/UInt16MultiArray",
                                 "std_msgs/msg/Int64MultiArray",
                                 "std_msgs/msg/Empty"};

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    out += c == '\n' ? "\\n" : std::string(1, c);
  }
  return out;
}

void print_types() {
  const char* before = "{";
  for (const char* const type : types) {
    for (const logs::RosDefinition& form : logs::bundled_ros_forms(type)) {
      fmt::print("{}\"{} {}\": \"{}\"", before, type, form.origin, escaped(logs::ros_definition_text(form)));
      before = ",\n";
    }
  }
  fmt::print("}}\n");
}

template <typename Message>
void write_some(logs::BagWriter& bag, const Message& message, const std::string& definition) {
  const auto topic = bag.add_topic(fmt::format("/{}", Message::type), Message::type, definition);
  logs::RosEncoder encoder;
  bag.write(topic, 5, encoder.encode(message));
}

template <typename Message>
void write_some(logs::BagWriter& bag, const Message& message) {
  write_some(bag, message, logs::ros_definition_text(logs::bundled_ros_definition(Message::type).value()));
}

void write(const char* path) {
  std::mt19937_64 random(9);
  const auto fill = [&](auto& numbers) {
    for (double& number : numbers) {
      number = static_cast<double>(random()) * 1e-15 - 9000.0;
    }
  };
  logs::BagWriter bag(path);
  logs::RosJointState joints;
  joints.header = {1'234'567'890'123'456'789, "odd"};
  joints.name = {"left", "right_wheel", ""};
  joints.position.resize(3);
  joints.velocity.resize(2);
  fill(joints.position);
  fill(joints.velocity);
  write_some(bag, joints);
  logs::RosOdometry odometry;
  odometry.header = {1, "o"};
  odometry.child_frame_id = "child";
  fill(odometry.pose.position);
  fill(odometry.pose.orientation);
  fill(odometry.pose_covariance);
  fill(odometry.twist.linear);
  fill(odometry.twist.angular);
  fill(odometry.twist_covariance);
  write_some(bag, odometry);
  logs::RosPoseStamped pose;
  fill(pose.pose.position);
  fill(pose.pose.orientation);
  write_some(bag, pose);
  logs::RosTwistStamped twist;
  fill(twist.twist.linear);
  fill(twist.twist.angular);
  write_some(bag, twist);
  logs::RosImu imu;
  fill(imu.orientation);
  fill(imu.orientation_covariance);
  fill(imu.angular_velocity);
  fill(imu.angular_velocity_covariance);
  fill(imu.linear_acceleration);
  fill(imu.linear_acceleration_covariance);
  write_some(bag, imu);
  logs::RosColumns columns;
  columns.values.resize(3);
  fill(columns.values);
  write_some(bag, columns, logs::columns_definition({"rho", "lower", "upper"}));
  bag.commit();
}

/// `path` with 0, 1 and 2 in place of every "[]".
void expand(const std::string& path, std::vector<std::string>& paths) {
  const std::size_t list = path.find("[]");
  if (list == std::string::npos) {
    paths.push_back(path);
    return;
  }
  for (const char* const index : {"[0]", "[1]", "[2]"}) {
    expand(path.substr(0, list) + index + path.substr(list + 2), paths);
  }
}

void read(const char* path) {
  const auto bag = logs::open_bag({path});
  logs::BagMessage message;
  while (bag->next(message)) {
    const logs::BagTopic& topic = bag->topics()[message.topic];
    std::vector<std::string> paths;
    for (const std::string& list : logs::numeric_paths(*topic.definition)) {
      expand(list, paths);
    }
    logs::RosExtractor extractor(*topic.definition, paths);
    std::vector<double> values(paths.size());
    if (!extractor.read(message.data, values)) {
      throw Error(topic.name + ": " + extractor.error());
    }
    for (std::size_t k = 0; k < paths.size(); ++k) {
      if (!std::isnan(values[k]) && paths[k].find("structure_needs") == std::string::npos) {
        fmt::print("{} {} {:016x}\n", topic.name, paths[k], std::bit_cast<std::uint64_t>(values[k]));
      }
    }
  }
}

}  // namespace

int main(int count, char** words) {
  try {
    const std::string verb = count > 1 ? words[1] : "";
    if (verb == "types" && count == 2) {
      print_types();
    } else if (verb == "write" && count == 3) {
      write(words[2]);
    } else if (verb == "read" && count == 3) {
      read(words[2]);
    } else {
      fmt::print(stderr, "usage: check_bag types | write FILE | read FILE\n");
      return 2;
    }
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "check_bag: {}\n", error.what());
    return 1;
  }
}

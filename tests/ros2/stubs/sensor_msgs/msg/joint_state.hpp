// SPDX-License-Identifier: Apache-2.0
/// \file
/// Stands in for the header of ROS 2 of this name where ROS is not to be had.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <std_msgs/msg/header.hpp>

namespace sensor_msgs::msg {

struct JointState {
  using SharedPtr = std::shared_ptr<JointState>;
  using ConstSharedPtr = std::shared_ptr<const JointState>;
  std_msgs::msg::Header header;
  std::vector<std::string> name;
  std::vector<double> position;
  std::vector<double> velocity;
  std::vector<double> effort;
};

}  // namespace sensor_msgs::msg

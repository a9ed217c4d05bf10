// SPDX-License-Identifier: Apache-2.0
/// \file
/// Stands in for the header of ROS 2 of this name where ROS is not to be had.
#pragma once

#include <string>

#include <builtin_interfaces/msg/time.hpp>

namespace std_msgs::msg {

struct Header {
  builtin_interfaces::msg::Time stamp;
  std::string frame_id;
};

}  // namespace std_msgs::msg

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Stands in for the header of ROS 2 of this name where ROS is not to be had.
#pragma once

#include <string>

namespace diagnostic_msgs::msg {

struct KeyValue {
  std::string key;
  std::string value;
};

}  // namespace diagnostic_msgs::msg

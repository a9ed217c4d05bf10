// SPDX-License-Identifier: Apache-2.0
/// \file
/// Stands in for the header of ROS 2 of this name where ROS is not to be had.
#pragma once

#include <string>
#include <vector>

#include <diagnostic_msgs/msg/key_value.hpp>

namespace diagnostic_msgs::msg {

struct DiagnosticStatus {
  static constexpr unsigned char OK = 0;
  static constexpr unsigned char WARN = 1;
  static constexpr unsigned char ERROR = 2;
  static constexpr unsigned char STALE = 3;
  unsigned char level = 0;
  std::string name;
  std::string message;
  std::string hardware_id;
  std::vector<KeyValue> values;
};

}  // namespace diagnostic_msgs::msg

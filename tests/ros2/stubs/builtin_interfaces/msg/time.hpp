// SPDX-License-Identifier: Apache-2.0
/// \file
/// Stands in for the header of ROS 2 of this name where ROS is not to be had.
#pragma once

#include <cstdint>

namespace builtin_interfaces::msg {

struct Time {
  std::int32_t sec = 0;
  std::uint32_t nanosec = 0;
};

}  // namespace builtin_interfaces::msg

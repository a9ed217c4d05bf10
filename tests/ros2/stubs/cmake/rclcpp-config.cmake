# SPDX-License-Identifier: Apache-2.0
# Stands in for the package of ROS 2 of this name where ROS is not to be had.
if(NOT TARGET rclcpp::rclcpp)
  add_library(rclcpp::rclcpp INTERFACE IMPORTED)
  target_include_directories(rclcpp::rclcpp INTERFACE ${CMAKE_CURRENT_LIST_DIR}/..)
endif()

# SPDX-License-Identifier: Apache-2.0
# Stands in for the package of ROS 2 of this name where ROS is not to be had.
if(NOT TARGET diagnostic_msgs::diagnostic_msgs)
  add_library(diagnostic_msgs::diagnostic_msgs INTERFACE IMPORTED)
  target_include_directories(diagnostic_msgs::diagnostic_msgs INTERFACE ${CMAKE_CURRENT_LIST_DIR}/..)
endif()
set(diagnostic_msgs_TARGETS diagnostic_msgs::diagnostic_msgs)

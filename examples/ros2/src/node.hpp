// SPDX-License-Identifier: Apache-2.0
/// \file
/// ROS 2 node around a Monitor: JointState in, DiagnosticArray out.
#pragma once

#include <memory>
#include <string>

#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <rclcpp/rclcpp.hpp>
#include <sensor_msgs/msg/joint_state.hpp>

#include "monitor.hpp"

namespace wheelwright_diagnostics {

/// For an executor of one thread.
class DiagnosticsNode : public rclcpp::Node {
 public:
  /// Reads the parameters and the model. Throws wheelwright::Error, naming parameter or file, where they make no sense.
  explicit DiagnosticsNode(const rclcpp::NodeOptions& options = rclcpp::NodeOptions());

 private:
  void take(const sensor_msgs::msg::JointState& message);
  void publish();

  rclcpp::Clock steady_{RCL_STEADY_TIME};
  std::unique_ptr<Monitor> monitor_;
  std::string hardware_;
  Level told_ = Level::warn;
  rclcpp::Publisher<diagnostic_msgs::msg::DiagnosticArray>::SharedPtr publisher_;
  rclcpp::Subscription<sensor_msgs::msg::JointState>::SharedPtr subscription_;
  rclcpp::TimerBase::SharedPtr timer_;
};

}  // namespace wheelwright_diagnostics

// SPDX-License-Identifier: Apache-2.0
#include "node.hpp"

#include <chrono>
#include <cstdint>
#include <utility>
#include <vector>

#include <wheelwright/core/error.hpp>
#include <wheelwright/formats/robots/online_model_file.hpp>

namespace wheelwright_diagnostics {

DiagnosticsNode::DiagnosticsNode(const rclcpp::NodeOptions& options) : Node("wheelwright_diagnostics", options) {
  using Names = std::vector<std::string>;
  const auto path = declare_parameter<std::string>("model", "");
  const auto topic = declare_parameter<std::string>("joint_states_topic", "joint_states");
  Sides sides;
  sides.right = declare_parameter<Names>("right_joints", Names{"right_wheel_joint"});
  sides.left = declare_parameter<Names>("left_joints", Names{"left_wheel_joint"});
  MonitorOptions monitor;
  monitor.clear_after = declare_parameter<double>("clear_after", monitor.clear_after);
  monitor.patience = declare_parameter<double>("patience", monitor.patience);
  const auto rate = declare_parameter<double>("rate", 1.0);
  const auto best_effort = declare_parameter<bool>("best_effort", false);
  hardware_ = declare_parameter<std::string>("hardware_id", "");
  if (path.empty()) {
    throw wheelwright::InvalidArgument("model: empty: expected the path of a model.json");
  }
  if (!(rate >= 0.01 && rate <= 1000.0)) {
    throw wheelwright::InvalidArgument("rate: " + std::to_string(rate) + ": expected 0.01 to 1000 messages a second");
  }
  const wheelwright::OnlineModel model = wheelwright::read_model(path);
  monitor_ = std::make_unique<Monitor>(model, sides, steady_.now().seconds(), monitor);
  if (hardware_.empty()) {
    hardware_ = model.robot.name;
  }

  publisher_ = create_publisher<diagnostic_msgs::msg::DiagnosticArray>("/diagnostics", 10);
  rclcpp::QoS qos(100);
  if (best_effort) {
    qos.best_effort();
  }
  subscription_ = create_subscription<sensor_msgs::msg::JointState>(
      topic, qos, [this](const sensor_msgs::msg::JointState& message) { take(message); });
  timer_ = create_wall_timer(std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / rate)), [this] { publish(); });
}

void DiagnosticsNode::take(const sensor_msgs::msg::JointState& message) {
  const double now = steady_.now().seconds();
  monitor_->take({.stamp = std::int64_t{message.header.stamp.sec} * 1'000'000'000 + message.header.stamp.nanosec,
                  .names = message.name,
                  .position = message.position,
                  .velocity = message.velocity,
                  .effort = message.effort},
                 now);
  if (monitor_->level(now) != told_) {
    publish();
  }
}

void DiagnosticsNode::publish() {
  Status status = monitor_->status(steady_.now().seconds());
  told_ = status.level;
  diagnostic_msgs::msg::DiagnosticStatus out;
  out.level = static_cast<unsigned char>(status.level);
  out.name = std::string(get_name()) + ": torque residual";
  out.message = std::move(status.message);
  out.hardware_id = hardware_;
  for (auto& [key, value] : status.values) {
    diagnostic_msgs::msg::KeyValue pair;
    pair.key = std::move(key);
    pair.value = std::move(value);
    out.values.push_back(std::move(pair));
  }
  diagnostic_msgs::msg::DiagnosticArray array;
  array.header.stamp = now();
  array.status.push_back(std::move(out));
  publisher_->publish(array);
}

}  // namespace wheelwright_diagnostics

// SPDX-License-Identifier: Apache-2.0
#include "formats/logs/velocity_commands.hpp"

#include <cmath>
#include <vector>

#include "formats/logs/bag_write.hpp"
#include "formats/logs/ros_messages.hpp"

namespace wheelwright::logs {

void write_velocity_commands(const std::filesystem::path& path, const LogTable& commands) {
  constexpr double ns_per_s = 1e9;
  const std::vector<double>& linear = commands.column("linear_x");
  const std::vector<double>& angular = commands.column("angular_z");
  BagWriter bag(path);
  const auto add = [&](const char* topic, const char* type) {
    return bag.add_topic(topic, type, ros_definition_text(*bundled_ros_definition(type)));
  };
  const std::size_t stamped = add("/cmd_vel", RosTwistStamped::type), bare = add("/cmd_vel_unstamped", RosTwist::type);
  RosEncoder encoder;
  RosTwistStamped message;
  message.header.frame_id = "base_link";
  for (std::size_t k = 0; k < commands.t.size(); ++k) {
    const std::int64_t time = std::llround(commands.t[k] * ns_per_s);
    message.twist.linear[0] = linear[k];
    message.twist.angular[2] = angular[k];
    bag.write(stamped, time, encoder.encode(message));
    bag.write(bare, time, encoder.encode(message.twist));
  }
  bag.commit();
}

}  // namespace wheelwright::logs

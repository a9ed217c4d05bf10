// SPDX-License-Identifier: Apache-2.0
#include <cmath>

#include <nlohmann/json.hpp>

#include "formats/robots/controller_file.hpp"
#include "formats/robots/robot_file.hpp"
#include "formats/robots/robot_origin.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

// What is read of a controller is > 0 and finite, and the robot file that is made of it is read as the same robot.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::clean([&] {
    const robots::DriveFacts facts =
        robots::parse_ros2_control(fuzz::text_of(data, size, fuzz::kLongestControllers), "controllers.yaml");
    for (const auto* number : {&facts.wheel_radius, &facts.track_width, &facts.speed, &facts.yaw_rate,
                               &facts.acceleration, &facts.yaw_acceleration, &facts.wheel_effort}) {
      fuzz::require(!*number || (std::isfinite((*number)->value) && (*number)->value > 0.0));
    }
    const robots::RobotWithOrigins robot = robots::robot_from(nullptr, &facts);
    fuzz::promised([&] {
      const Robot again = robots::parse_robot(robots::robot_yaml(robot), "again.yaml");
      fuzz::require(robots::to_json(again) == robots::to_json(robot.robot));
    });
  });
}

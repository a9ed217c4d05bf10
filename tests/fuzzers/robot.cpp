// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "formats/robots/robot_file.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

// A robot file that is read is written as one that says the same, and so is its JSON.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::clean([&] {
    const Robot robot = robots::parse_robot(fuzz::text_of(data, size, fuzz::kLongestYaml), "robot.yaml");
    const Json object = robots::to_json(robot);
    fuzz::promised([&] {
      fuzz::require(robots::to_json(robots::parse_robot(robots::robot_yaml(robot), "again.yaml")) == object);
      fuzz::require(robots::to_json(robots::robot_from_json(object, "again.json")) == object);
    });
  });
}

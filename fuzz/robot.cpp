// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/robot_file.hpp>

#include "fuzz.hpp"

using namespace wheelwright;

// A robot file that is read is written as one that says the same.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::clean([&] {
    const std::string once = robots::robot_yaml(robots::parse_robot(fuzz::text_of(data, size), "robot.yaml"));
    try {
      fuzz::require(robots::robot_yaml(robots::parse_robot(once, "again.yaml")) == once);
    } catch (const InputError&) {
      fuzz::require(false);
    }
  });
}

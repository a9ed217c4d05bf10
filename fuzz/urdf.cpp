// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/robot_description.hpp>

#include "fuzz.hpp"

using namespace wheelwright;

int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::clean([&] { static_cast<void>(robots::parse_urdf(fuzz::text_of(data, size), "robot.urdf")); });
}

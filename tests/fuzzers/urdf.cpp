// SPDX-License-Identifier: Apache-2.0
#include <nlohmann/json.hpp>

#include "formats/robots/robot_description.hpp"
#include "formats/robots/robot_file.hpp"
#include "formats/robots/robot_origin.hpp"
#include "tests/fuzzers/fuzz.hpp"

using namespace wheelwright;

// Of a description that is read every number is finite; the robot file that is made of it is read as the same robot.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return fuzz::clean([&] {
    const robots::RobotTree tree = robots::parse_urdf(fuzz::text_of(data, size), "robot.urdf");
    for (const robots::TreeLink& link : tree.links) {
      fuzz::require(!link.inertial || (link.inertial->mass >= 0.0 && link.inertial->centre.allFinite() &&
                                       link.inertial->tensor.allFinite()));
      for (const robots::TreeShape& shape : link.shapes) {
        fuzz::require(shape.radius >= 0.0 && shape.centre.allFinite() && shape.axis.allFinite());
      }
    }
    for (const robots::TreeJoint& joint : tree.joints) {
      fuzz::require(joint.origin.allFinite() && joint.axis.allFinite());
    }
    const robots::RobotWithOrigins robot = robots::robot_from(&tree, nullptr);
    fuzz::promised([&] {
      const Robot again = robots::parse_robot(robots::robot_yaml(robot), "again.yaml");
      fuzz::require(robots::to_json(again) == robots::to_json(robot.robot));
    });
  });
}

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/wheel_joints.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>

#include <fmt/format.h>

#include <wheelwright/files/suggest.hpp>

namespace wheelwright {
namespace {

constexpr double across = 0.99939;  // cos 2°

constexpr const char* kSkidSteer =
    "robots that skid with two or more wheels a side have no model yet (skid_steer): expected one driven wheel a side; "
    "where the wheels of a side turn as one and the others hardly slip, name one of each with --left and --right";

std::string lower(const TreeJoint& joint) {
  std::string out = joint.name + " " + joint.child;
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return std::tolower(c); });
  return out;
}

bool says(const TreeJoint& joint, const char* word) { return lower(joint).find(word) != std::string::npos; }

bool turns(const TreeJoint& joint) { return joint.type == "continuous" || joint.type == "revolute"; }

std::vector<TreeJoint> candidates_of(const RobotTree& tree) {
  std::vector<TreeJoint> out;
  for (const TreeJoint& joint : tree.joints) {
    if (joint.type == "continuous" && std::abs(joint.axis.y()) >= across && !says(joint, "caster") &&
        !says(joint, "castor")) {
      out.push_back(joint);
    }
  }
  if (out.size() > 2) {
    std::vector<TreeJoint> wheels;
    std::copy_if(out.begin(), out.end(), std::back_inserter(wheels), [](const auto& j) { return says(j, "wheel"); });
    return wheels.size() < 2 ? out : wheels;
  }
  return out;
}

std::string described(const std::vector<TreeJoint>& joints) {
  std::string out;
  for (const TreeJoint& joint : joints) {
    out += fmt::format("\n  {} ({}, y = {:.6g} m)", joint.name, joint.place.where, joint.origin.y());
  }
  return out;
}

TreeJoint by_name(const RobotTree& tree, const std::string& name, const std::string& by) {
  const TreeJoint* found = tree.joint(name);
  std::vector<std::string> names;
  for (const TreeJoint& joint : tree.joints) {
    if (turns(joint)) {
      names.push_back(joint.name);
    }
  }
  if (found == nullptr) {
    throw InputError(fmt::format("{}: {} has no joint {}: expected one of {}{}", by, tree.place.text(), shown(name),
                                 listed(names), did_you_mean(name, names)));
  }
  if (!turns(*found)) {
    found->place.fail(fmt::format("is {}, and {} calls it a wheel: expected a joint that turns, one of {}",
                                  shown(found->type), by, listed(names)));
  }
  return *found;
}

void require_sides(const WheelJoints& wheels) {
  if (wheels.left.name == wheels.right.name) {
    wheels.left.place.fail("is both wheels: expected two joints");
  }
  if (!(wheels.left.origin.y() > wheels.right.origin.y())) {
    throw InputError(fmt::format(
        "{} is said to be left of {} ({}), and stands at y = {:.6g} m against {:.6g} m: expected the left one at the "
        "larger y (x ahead, y to the left)",
        wheels.left.place.text(), wheels.right.place.text(), wheels.reason, wheels.left.origin.y(),
        wheels.right.origin.y()));
  }
}

// "left_wheel" on the right side is a description that contradicts itself.
void require_names_agree(const WheelJoints& wheels) {
  if ((says(wheels.left, "right") && !says(wheels.left, "left")) ||
      (says(wheels.right, "left") && !says(wheels.right, "right"))) {
    throw InputError(
        fmt::format("{} stands left of {}, against their names: expected y to the left, or --left and "
                    "--right",
                    wheels.left.place.text(), wheels.right.place.text()));
  }
}

}  // namespace

WheelJoints driven_wheels(const RobotTree& tree, const NamedWheels& named) {
  if (named.left.empty() != named.right.empty()) {
    throw InputError(fmt::format("{}: names the wheels of one side only: expected both", named.by));
  }
  if (named.left.size() > 1 || named.right.size() > 1) {
    throw InputError(fmt::format("{}: names {} left and {} right wheels: {}", named.by, named.left.size(),
                                 named.right.size(), kSkidSteer));
  }
  if (!named.left.empty()) {
    WheelJoints out{by_name(tree, named.right.front(), named.by), by_name(tree, named.left.front(), named.by),
                    "named by " + named.by};
    require_sides(out);
    return out;
  }
  std::vector<TreeJoint> found = candidates_of(tree);
  if (found.size() > 2) {
    const auto left = std::count_if(found.begin(), found.end(), [](const auto& j) { return j.origin.y() > 0.0; });
    const bool pairs = found.size() % 2 == 0 && 2 * left == static_cast<std::ptrdiff_t>(found.size());
    throw InputError(fmt::format("{}: {} joints may be driven wheels{}:{}\n{}", tree.place.text(), found.size(),
                                 pairs ? ", as many on each side" : "", described(found),
                                 pairs ? kSkidSteer : "expected two: name them with --left and --right"));
  }
  if (found.size() < 2) {
    std::vector<TreeJoint> any;
    std::copy_if(tree.joints.begin(), tree.joints.end(), std::back_inserter(any), turns);
    throw InputError(
        fmt::format("{}: {} joint with an axis across the robot (y) turns without end: expected the two "
                    "driven wheels, or --left and --right; the joints that turn:{}",
                    tree.place.text(), found.empty() ? "no" : "only one", any.empty() ? " none" : described(any)));
  }
  if (found[0].origin.y() > found[1].origin.y()) {
    std::swap(found[0], found[1]);
  }
  WheelJoints out{found[0], found[1], "the continuous joints whose axes lie across the robot"};
  require_sides(out);
  require_names_agree(out);
  return out;
}

}  // namespace wheelwright

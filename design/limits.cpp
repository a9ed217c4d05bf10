// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/design/limits.hpp>

#include <wheelwright/core/check.hpp>

namespace wheelwright {

MotionLimits limits_of(const Robot& robot) {
  MotionLimits limits;
  const auto find = [&robot](const char* name) -> std::optional<double> {
    const auto found = robot.limits.find(name);
    return found == robot.limits.end() ? std::nullopt : std::optional(found->second);
  };
  limits.joint_speed = find("speed").value_or(0.0);
  limits.joint_acceleration = find("acceleration");
  limits.effort = find("effort");
  return limits;
}

void validate(const MotionLimits& limits) {
  check::positive(limits.duration, "limits.duration");
  check::positive(limits.joint_speed, "limits.joint_speed");
  check::that(limits.joint_acceleration || limits.effort, "limits.joint_acceleration",
              "a limit on the acceleration or on the effort");
  if (limits.joint_acceleration) {
    check::positive(*limits.joint_acceleration, "limits.joint_acceleration");
  }
  if (limits.effort) {
    check::positive(*limits.effort, "limits.effort");
  }
  if (limits.radius) {
    check::positive(*limits.radius, "limits.radius");
  }
  if (limits.box) {
    for (const Interval& side : *limits.box) {
      check::that(side.lower < 0.0 && side.upper > 0.0 && side.upper - side.lower < 1e9, "limits.box",
                  "finite sides with the start, [0, 0], inside");
    }
  }
}

}  // namespace wheelwright

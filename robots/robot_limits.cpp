// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/robot_limits.hpp>

#include <algorithm>

#include <fmt/format.h>

namespace wheelwright {
namespace {

// The smallest of the limits that there are.
struct Limit {
  double value;
  std::string origin;
};

void set_limit(RobotWithOrigins& out, const std::string& key, std::vector<Limit> all) {
  std::erase_if(all, [&](const Limit& limit) {
    if (limit.value == 0.0) {
      out.remarks.push_back("limits." + key + ": not taken: 0: " + limit.origin);
    }
    return limit.value == 0.0;
  });
  if (all.empty()) {
    return;
  }
  std::stable_sort(all.begin(), all.end(), [](const Limit& a, const Limit& b) { return a.value < b.value; });
  out.robot.limits[key] = all.front().value;
  std::string origin = all.front().origin;
  for (std::size_t k = 1; k < all.size(); ++k) {
    origin += all[k].value == all.front().value ? " and " + all[k].origin
                                                : fmt::format("; less than {:.6g}: {}", all[k].value, all[k].origin);
  }
  out.origins["limits." + key] = origin;
}

}  // namespace

void add_limits(RobotWithOrigins& out, const WheelJoints* wheels, const std::vector<const DriveFacts*>& drives) {
  const double r = out.robot.wheel_radius, half = 0.5 * out.robot.track_width;
  std::vector<Limit> effort, speed, acceleration;
  if (wheels) {
    for (const TreeJoint* joint : {&wheels->right, &wheels->left}) {
      if (joint->effort) {
        effort.push_back({joint->effort->value, joint->effort->place.text()});
      }
      if (joint->velocity) {
        speed.push_back({joint->velocity->value, joint->velocity->place.text()});
      }
    }
  }
  for (const DriveFacts* facts : drives) {
    if (facts == nullptr) {
      continue;
    }
    const auto add = [](std::vector<Limit>& to, const std::optional<OriginNumber>& number, double factor,
                        const std::string& how) {
      if (number) {
        to.push_back({factor * number->value, number->place.text() + how});
      }
    };
    add(speed, facts->speed, 1.0 / r, " / r");
    add(speed, facts->yaw_rate, half / r, " D/(2r)");
    add(acceleration, facts->acceleration, 1.0 / r, " / r");
    add(acceleration, facts->yaw_acceleration, half / r, " D/(2r)");
    add(effort, facts->wheel_effort, 1.0, "");
  }
  if (out.robot.effort == EffortKind::torque) {
    set_limit(out, "effort", std::move(effort));
  } else if (!effort.empty()) {
    out.remarks.push_back("limits.effort: not taken, because it is a torque and efforts are not: " +
                          effort.front().origin);
  }
  set_limit(out, "speed", std::move(speed));
  set_limit(out, "acceleration", std::move(acceleration));
}

void add_effort(RobotWithOrigins& out, const RobotTree* tree, const WheelJoints* wheels) {
  Robot& robot = out.robot;
  std::vector<const JointInterfaces*> of_wheels;
  for (std::size_t k = 0; tree != nullptr && k < tree->interfaces.size(); ++k) {
    const JointInterfaces& each = tree->interfaces[k];
    if (each.joint == wheels->right.name || each.joint == wheels->left.name) {
      of_wheels.push_back(&each);
    }
  }
  const auto with = [&](std::vector<std::string> JointInterfaces::*list, const std::string& word) {
    const auto found = std::find_if(of_wheels.begin(), of_wheels.end(), [&](const JointInterfaces* each) {
      return std::find((each->*list).begin(), (each->*list).end(), word) != (each->*list).end();
    });
    return found == of_wheels.end() ? nullptr : *found;
  };
  out.origins["effort.kind"] =
      "default, because no interface of the wheels tells; current or voltage where the log has them";
  out.origins["effort.hold"] =
      "default, because no file tells whether the log's efforts are measured (first_order) or commands";
  if (!of_wheels.empty()) {
    out.origins["effort.kind"] = of_wheels.front()->place.text() +
                                 ": default, because the wheels have no effort interface: the log needs torque, "
                                 "current or voltage from elsewhere";
  }
  const std::vector<std::pair<std::string, EffortKind>> words = {
      {"effort", EffortKind::torque}, {"current", EffortKind::current}, {"voltage", EffortKind::voltage}};
  bool found = false;
  for (const auto& [word, kind] : words) {
    const JointInterfaces* state = with(&JointInterfaces::states, word);
    const JointInterfaces* command = with(&JointInterfaces::commands, word);
    if (found || (state == nullptr && command == nullptr)) {
      continue;
    }
    found = true;
    robot.effort = kind;
    robot.hold = state != nullptr ? Hold::first_order : Hold::zero_order;
    const std::string where = (state != nullptr ? state : command)->place.text();
    out.origins["effort.kind"] =
        fmt::format("{}: {} interface {}", where, state != nullptr ? "state" : "command", word);
    out.origins["effort.hold"] =
        where + (state != nullptr ? ": it is measured" : ": it is a command, held till the next");
  }
  out.origins["effort.changes"] = "default, because no file tells";
  out.origins["effort.delay"] = "default, because no file tells";
  out.origins["effort.unsigned"] = "default, because no file tells";
  for (const JointInterfaces* each : of_wheels) {
    if (each->reduction && !robot.motor) {
      robot.motor = Motor{};
      robot.motor->gear_ratio = each->reduction->value;
      out.origins["motor.gear_ratio"] = each->reduction->place.text();
    }
  }
}

}  // namespace wheelwright

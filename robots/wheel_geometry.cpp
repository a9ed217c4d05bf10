// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/wheel_geometry.hpp>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace wheelwright {
namespace {

constexpr double straight = 0.99939;  // cos 2°
constexpr double level = 0.0349;      // sin 2°
constexpr double eccentric = 0.01;    // of the radius
constexpr double same_radius = 1e-5;  // of the radius
constexpr double same_centre = 1e-6;  // m
constexpr const char* kGive = "give --wheel-radius";

// The shape that rolls, else the one that says why there is none.
struct Rolling {
  const TreeShape* round = nullptr;
  const TreeShape* other = nullptr;
};

Rolling rolling(const RobotTree& tree, const TreeJoint& joint) {
  Rolling out;
  const std::vector<std::string> links = turning_links(tree, joint);
  for (const bool collision : {true, false}) {
    for (const std::string& name : links) {
      for (const TreeShape& shape : tree.link(name)->shapes) {
        if (shape.collision != collision) {
          continue;
        }
        const bool round =
            shape.kind == "sphere" || (shape.kind == "cylinder" && std::abs(shape.axis.dot(joint.axis)) >= straight);
        if (round && (out.round == nullptr || shape.radius > out.round->radius)) {
          out.round = &shape;
        } else if (!round && out.other == nullptr) {
          out.other = &shape;
        }
      }
    }
    if (out.round != nullptr || (collision && out.other != nullptr && out.other->kind != "mesh")) {
      break;
    }
  }
  return out;
}

Eigen::Vector3d centre(const RobotTree& tree, const TreeJoint& joint) {
  const Rolling shape = rolling(tree, joint);
  return shape.round == nullptr
             ? joint.origin
             : Eigen::Vector3d(joint.origin + joint.axis * joint.axis.dot(shape.round->centre - joint.origin));
}

void require_centred(const TreeJoint& joint, const TreeShape& shape) {
  const Eigen::Vector3d d = shape.centre - joint.origin;
  const double off = (d - joint.axis * joint.axis.dot(d)).norm();
  if (off > eccentric * shape.radius) {
    shape.place.fail(fmt::format("stands {:.3g} m off the axis of {}: expected a wheel that turns about its centre",
                                 off, joint.place.text()));
  }
}

}  // namespace

std::vector<std::string> turning_links(const RobotTree& tree, const TreeJoint& joint) {
  std::vector<std::string> out = {joint.child};
  for (std::size_t k = 0; k < out.size(); ++k) {
    for (const TreeJoint& below : tree.joints) {
      if (below.parent == out[k] && below.type == "fixed") {
        out.push_back(below.child);
      }
    }
  }
  return out;
}

WheelRadius wheel_radius(const RobotTree& tree, const WheelJoints& wheels) {
  const TreeShape* round[2] = {};
  for (std::size_t side = 0; side < 2; ++side) {
    const TreeJoint& joint = side == 0 ? wheels.right : wheels.left;
    const Rolling shape = rolling(tree, joint);
    if (shape.round == nullptr) {
      if (shape.other == nullptr) {
        return {{},
                fmt::format("{}: the wheel has neither collision nor visual: {}", tree.link(joint.child)->place.text(),
                            kGive)};
      }
      return {{},
              fmt::format("{}: {}: {}", shape.other->place.text(),
                          shape.other->kind == "cylinder"
                              ? "its axis is not that of the wheel's joint, so that it cannot roll"
                              : "has no radius: expected a cylinder or a sphere",
                          kGive)};
    }
    require_centred(joint, *shape.round);
    round[side] = shape.round;
  }
  const double r = round[0]->radius, l = round[1]->radius;
  if (std::abs(r - l) > same_radius * std::max(r, l)) {
    round[1]->place.fail(
        fmt::format("radius {} m, and {} m at {}: expected one radius; give the mean of both as --wheel-radius and "
                    "their difference in "
                    "the robot file, effects: [{{effect: wheel_radius_asymmetric, epsilon: (r_R − r_L)/(r_R + r_L)}}]",
                    l, r, round[0]->place.text()));
  }
  std::string origin = fmt::format("{} and {}", round[0]->place.text(), round[1]->place.where);
  if (!round[0]->collision || !round[1]->collision) {
    origin += ", a visual shape, since there is no round collision shape";
  }
  return {r == l ? r : 0.5 * (r + l), origin};
}

Axle axle(const RobotTree& tree, const WheelJoints& wheels) {
  const auto& [right, left, reason] = wheels;
  Axle out;
  const Eigen::Vector3d c_r = centre(tree, right), c_l = centre(tree, left);
  const Eigen::Vector3d apart = c_l - c_r;
  if (!(apart.norm() > 1e-6)) {
    left.place.fail(fmt::format("stands at the place of {}: expected a track width > 0", right.place.text()));
  }
  const double side = right.axis.dot(apart) < 0.0 ? -1.0 : 1.0;
  const double same = right.axis.dot(left.axis) < 0.0 ? -1.0 : 1.0;
  out.left = (side * (right.axis + same * left.axis)).normalized();
  if (!(std::abs(right.axis.dot(left.axis)) >= straight)) {
    left.place.fail(fmt::format("has another axis than {}: expected parallel wheels", right.place.text()));
  }
  if (!(out.left.dot(apart) >= straight * apart.norm())) {
    left.place.fail(fmt::format("and {} do not share an axle: expected the line between them along their axes",
                                right.place.text()));
  }
  if (!(std::abs(out.left.z()) <= level)) {
    left.place.fail("has an axis that is not level: expected z of the root link upwards");
  }
  out.ahead = out.left.cross(Eigen::Vector3d::UnitZ()).normalized();
  out.up = out.ahead.cross(out.left);
  out.middle = 0.5 * (c_r + c_l);
  out.track_width = out.left.dot(apart);
  const double of_joints = out.left.dot(left.origin - right.origin);
  out.origin = fmt::format("between the origins of {} and {}", left.place.text(), right.place.text());
  if (std::abs(of_joints - out.track_width) > same_centre) {
    out.origin = fmt::format("between the centres of the wheels' shapes, {:.6g} m between the origins of {} and {}",
                             of_joints, left.place.text(), right.place.text());
  }
  for (const TreeJoint* joint : {&right, &left}) {
    if (joint->axis.dot(out.left) < 0.0) {
      out.remarks.push_back(fmt::format(
          "{} turns the other way: its angle falls as the robot drives ahead, so change its sign in the log",
          joint->place.text()));
    }
  }
  return out;
}

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
#include "formats/robots/wheel_geometry.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <functional>

#include <fmt/format.h>

#include "formats/files/words.hpp"

namespace wheelwright::robots {
namespace {

constexpr double across = 0.99939;  // cos 2°

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
    throw InputError(fmt::format("{}: {} has no joint {}: expected one of {}{}", by, tree.place.text(),
                                 files::shown(name), core::listed(names), files::did_you_mean(name, names)));
  }
  if (!turns(*found)) {
    found->place.fail(fmt::format("is {}, and {} calls it a wheel: expected a joint that turns, one of {}",
                                  files::shown(found->type), by, core::listed(names)));
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
  if (named.left.size() != named.right.size()) {
    throw InputError(fmt::format("{}: names {} left and {} right wheels: expected as many on each side", named.by,
                                 named.left.size(), named.right.size()));
  }
  if (!named.left.empty()) {
    WheelJoints out{by_name(tree, named.right.front(), named.by),
                    by_name(tree, named.left.front(), named.by),
                    "named by " + named.by,
                    {}};
    require_sides(out);
    for (std::size_t k = 1; k < named.left.size(); ++k) {
      out.others.push_back(by_name(tree, named.right[k], named.by));
      out.others.push_back(by_name(tree, named.left[k], named.by));
    }
    return out;
  }
  std::vector<TreeJoint> found = candidates_of(tree);
  if (found.size() > 2) {
    const auto left = std::count_if(found.begin(), found.end(), [](const auto& j) { return j.origin.y() > 0.0; });
    if (2 * left != static_cast<std::ptrdiff_t>(found.size())) {
      throw InputError(
          fmt::format("{}: {} joints may be driven wheels:{}\nexpected as many on each side: name them with --left and "
                      "--right",
                      tree.place.text(), found.size(), described(found)));
    }
    std::ranges::stable_sort(found, std::greater(), [](const TreeJoint& j) { return j.origin.x(); });
    std::stable_partition(found.begin(), found.end(), [](const TreeJoint& j) { return j.origin.y() > 0.0; });
    const auto second = static_cast<std::ptrdiff_t>(found.size() / 2);
    WheelJoints out{found[static_cast<std::size_t>(second)],
                    found.front(),
                    "the continuous joints whose axes lie across the robot",
                    {}};
    require_names_agree(out);
    out.others.assign(found.begin() + 1, found.begin() + second);
    out.others.insert(out.others.end(), found.begin() + second + 1, found.end());
    return out;
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
  WheelJoints out{found[0], found[1], "the continuous joints whose axes lie across the robot", {}};
  require_sides(out);
  require_names_agree(out);
  return out;
}

namespace {

constexpr double straight = 0.99939;  // cos 2°
constexpr double level = 0.0349;      // sin 2°
constexpr double eccentric = 0.01;    // of the radius
constexpr double same_radius = 1e-5;  // of the radius
constexpr double same_centre = 1e-6;  // m
constexpr const char* kGive = "give --wheel-radius";
constexpr const char* kAllLinks = "all";  // every link with a shape and no inertial

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
  const TreeJoint &right = wheels.right, &left = wheels.left;
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
  for (const TreeJoint& other : wheels.others) {
    out.middle += out.ahead * out.ahead.dot(centre(tree, other) - 0.5 * (c_r + c_l)) /
                  static_cast<double>(2 + wheels.others.size());
  }
  if (!wheels.others.empty()) {
    out.remarks.push_back(
        fmt::format("{} wheels: the wheels of a side are taken to turn as one; such robots scrub in "
                    "curves, so that `identify` finds a wider track",
                    2 + wheels.others.size()));
  }
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

namespace {

bool holds(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

void require_links(const RobotTree& tree, const std::vector<std::string>& massless) {
  std::vector<std::string> names;
  for (const TreeLink& link : tree.links) {
    names.push_back(link.name);
  }
  for (const std::string& name : massless) {
    const TreeLink* link = tree.link(name);
    if (link == nullptr && name == kAllLinks) {
      continue;
    }
    if (link == nullptr) {
      throw InputError(fmt::format("--massless {}: {} has no such link{}", files::shown(name), tree.place.text(),
                                   files::did_you_mean(name, names)));
    }
    if (link->inertial) {
      link->inertial->place.fail("has a mass, and --massless says that it has none: expected one of both");
    }
  }
}

void require_masses(const std::vector<const TreeLink*>& bare) {
  if (bare.empty()) {
    return;
  }
  std::string others, options;
  for (const TreeLink* link : bare) {
    others += link == bare.front() ? "" : fmt::format("{}{}", others.empty() ? ", as have " : ", ", link->name);
    options += fmt::format(" --massless {}", link->name);
  }
  bare.front()->place.fail(fmt::format(
      "has a shape and no <inertial>{}: expected mass and inertia, or{}{}", others, options,
      bare.size() > 1 ? fmt::format("; where the mass of all {} stands elsewhere, --massless all", bare.size()) : ""));
}

}  // namespace

LumpedBody lumped_body(const RobotTree& tree, const WheelJoints& wheels, const Axle& axle,
                       const std::vector<std::string>& massless) {
  require_links(tree, massless);
  std::vector<std::string> turning = turning_links(tree, wheels.right);
  for (std::string& name : turning_links(tree, wheels.left)) {
    turning.push_back(std::move(name));
  }
  std::vector<const TreeLink*> bare;
  for (const TreeLink& link : tree.links) {
    if (!link.inertial && !link.shapes.empty() && !holds(massless, link.name) && !holds(massless, kAllLinks)) {
      bare.push_back(&link);
    }
  }
  require_masses(bare);
  LumpedBody out;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const TreeLink& link : tree.links) {
    if (!link.inertial) {
      out.massless.push_back(link.name);
      continue;
    }
    const auto& [m, centre, tensor, place] = *link.inertial;
    const Eigen::Vector3d d = centre - axle.middle;
    ++out.links;
    out.mass += m;
    if (holds(turning, link.name)) {
      const TreeJoint& joint = holds(turning_links(tree, wheels.right), link.name) ? wheels.right : wheels.left;
      const double along = axle.left.dot(tensor * axle.left);
      const double s = axle.left.dot(d);
      const Eigen::Vector3d from_joint = centre - joint.origin;
      const double off = (from_joint - axle.left * axle.left.dot(from_joint)).squaredNorm();
      out.spin += along + m * off;
      out.yaw_inertia += 0.5 * (tensor.trace() - along) + m * (s * s + 0.5 * off);
      moment += m * (joint.origin + axle.left * axle.left.dot(from_joint) - axle.middle);
    } else {
      out.yaw_inertia += axle.up.dot(tensor * axle.up) + m * axle.up.cross(d).squaredNorm();
      moment += m * d;
    }
  }
  if (!(out.mass > 0.0)) {
    tree.place.fail("no link has a mass: expected inertials");
  }
  if (!std::isfinite(out.mass) || !std::isfinite(out.yaw_inertia) || !(out.yaw_inertia > 0.0)) {
    tree.place.fail(fmt::format("a mass of {} kg with a yaw inertia of {} kg·m²: expected those of a body", out.mass,
                                out.yaw_inertia));
  }
  out.ahead = axle.ahead.dot(moment) / out.mass;
  out.left = axle.left.dot(moment) / out.mass;
  for (const TreeJoint& joint : tree.joints) {
    if (joint.type != "fixed" && joint.name != wheels.left.name && joint.name != wheels.right.name) {
      out.moving.push_back(joint.name);
    }
  }
  return out;
}

}  // namespace wheelwright::robots

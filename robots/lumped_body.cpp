// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/lumped_body.hpp>

#include <algorithm>

#include <fmt/format.h>

#include <wheelwright/files/suggest.hpp>

namespace wheelwright {
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
    if (link == nullptr) {
      throw InputError(fmt::format("--massless {}: {} has no such link{}", shown(name), tree.place.text(),
                                   did_you_mean(name, names)));
    }
    if (link->inertial) {
      link->inertial->place.fail("has a mass, and --massless says that it has none: expected one of both");
    }
  }
}

}  // namespace

LumpedBody lumped_body(const RobotTree& tree, const WheelJoints& wheels, const Axle& axle,
                       const std::vector<std::string>& massless) {
  require_links(tree, massless);
  std::vector<std::string> turning = turning_links(tree, wheels.right);
  for (std::string& name : turning_links(tree, wheels.left)) {
    turning.push_back(std::move(name));
  }
  LumpedBody out;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (const TreeLink& link : tree.links) {
    if (!link.inertial) {
      if (!link.shapes.empty() && !holds(massless, link.name)) {
        link.place.fail(
            fmt::format("has a shape and no <inertial>: expected mass and inertia, or --massless {}", link.name));
      }
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

}  // namespace wheelwright

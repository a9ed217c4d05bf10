// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/robot_tree.hpp>

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <Eigen/Eigenvalues>

#include <wheelwright/files/suggest.hpp>

namespace wheelwright {
namespace {

constexpr double rounding = 1e-3;  // of the largest moment: files are written with three digits

template <typename Items>
auto* named(Items& items, const std::string& name) {
  const auto found = std::find_if(items.begin(), items.end(), [&](const auto& item) { return item.name == name; });
  return found == items.end() ? nullptr : &*found;
}

template <typename Items>
void require_unique(const Items& items) {
  std::map<std::string, const FilePlace*> seen;
  for (const auto& item : items) {
    const auto [before, fresh] = seen.emplace(item.name, &item.place);
    if (!fresh) {
      item.place.fail("has the name of " + before->second->text() + ": expected each name once");
    }
  }
}

}  // namespace

const TreeLink* RobotTree::link(const std::string& wanted) const { return named(links, wanted); }

const TreeJoint* RobotTree::joint(const std::string& wanted) const { return named(joints, wanted); }

void require_possible(const TreeInertial& inertial) {
  const double m = inertial.mass;
  const Eigen::Matrix3d& t = inertial.tensor;
  if (!std::isfinite(m) || !t.allFinite() || !inertial.centre.allFinite()) {
    inertial.place.fail("not finite: expected finite numbers");
  }
  if (!(m >= 0.0)) {
    inertial.place.fail(fmt::format("mass {}: expected a mass > 0 in kg", m));
  }
  if (m == 0.0 && !t.isZero(0.0)) {
    inertial.place.fail("mass 0 with an inertia: expected a mass > 0 in kg");
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(t, Eigen::EigenvaluesOnly);
  const Eigen::Vector3d p = solver.eigenvalues();  // in rising order
  if (!p.allFinite()) {
    inertial.place.fail("moments of inertia beyond reckoning: expected kg·m²");
  }
  const std::string moments = fmt::format("principal moments of inertia {:.6g}, {:.6g}, {:.6g}", p[0], p[1], p[2]);
  const double slack = rounding * p.cwiseAbs().maxCoeff();
  if (p[0] < -slack) {
    inertial.place.fail(moments + ": expected none below 0");
  }
  if (p[2] > p[0] + p[1] + slack) {
    inertial.place.fail(moments + ": expected none larger than the sum of the others, as those of any body are");
  }
}

void require_tree(const RobotTree& tree) {
  if (tree.links.empty()) {
    tree.place.fail("holds no link: expected links with their masses");
  }
  require_unique(tree.links);
  require_unique(tree.joints);
  std::map<std::string, const TreeJoint*> above;
  std::vector<std::string> names;
  for (const TreeLink& link : tree.links) {
    names.push_back(link.name);
    above[link.name] = nullptr;
  }
  for (const TreeJoint& joint : tree.joints) {
    for (const std::string& link : {joint.parent, joint.child}) {
      if (!above.contains(link)) {
        joint.place.fail(fmt::format("there is no link {}{}", shown(link), did_you_mean(link, names)));
      }
    }
    const TreeJoint*& parent = above[joint.child];
    if (parent != nullptr) {
      joint.place.fail(
          fmt::format("its child {} is that of {} too: expected a tree", shown(joint.child), parent->place.text()));
    }
    parent = &joint;
  }
  std::string root;
  for (const TreeLink& link : tree.links) {
    std::size_t steps = 0;
    std::string top = link.name;
    for (const TreeJoint* up = above[top]; up != nullptr; up = above[top]) {
      top = up->parent;
      if (++steps > tree.joints.size()) {
        up->place.fail("is part of a ring of joints: expected a tree");
      }
    }
    if (root.empty()) {
      root = top;
    } else if (top != root) {
      link.place.fail(fmt::format("hangs on {}, and other links on {}: expected one tree", shown(top), shown(root)));
    }
  }
}

}  // namespace wheelwright

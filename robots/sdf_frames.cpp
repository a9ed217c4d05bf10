// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/sdf_frames.hpp>

#include <numbers>

#include <wheelwright/files/words.hpp>
#include <wheelwright/robots/robot_description.hpp>

namespace wheelwright {

SdfFrames::SdfFrames(const XmlPlace& model) {
  for (const XmlPlace& link : model.children("link")) {
    add(link, "");
  }
  for (const XmlPlace& joint : model.children("joint")) {
    add(joint, joint.need("child").text());
  }
  for (const XmlPlace& frame : model.children("frame")) {
    add(frame, frame.attribute("attached_to").value_or(""));
  }
}

void SdfFrames::add(const XmlPlace& element, const std::string& otherwise) {
  const std::string name = element.need_attribute("name");
  const auto [it, fresh] = frames_.emplace(name, Frame{own_pose(element), relative_to(element, otherwise), element});
  if (!fresh) {
    element.fail("has the name of " + it->second.place.place().text() + ": expected each name once");
  }
}

Eigen::Isometry3d SdfFrames::own_pose(const XmlPlace& element) {
  const auto at = element.child("pose");
  if (!at || at->text().empty()) {
    return Eigen::Isometry3d::Identity();
  }
  if (at->attribute("rotation_format").value_or("euler_rpy") == "quat_xyzw") {
    const std::vector<double> v = at->numbers("", 7);
    const Eigen::Quaterniond q(v[6], v[3], v[4], v[5]);
    if (!(q.norm() > 1e-6)) {
      at->fail("a quaternion of length 0: expected a rotation");
    }
    Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
    out.translation() = Eigen::Vector3d(v[0], v[1], v[2]);
    out.linear() = q.normalized().toRotationMatrix();
    return out;
  }
  const std::vector<double> v = at->numbers("", 6);
  const double unit = at->attribute("degrees").value_or("false") == "true" ? std::numbers::pi / 180.0 : 1.0;
  return pose({v[0], v[1], v[2]}, unit * Eigen::Vector3d(v[3], v[4], v[5]));
}

std::string SdfFrames::relative_to(const XmlPlace& element, const std::string& otherwise) {
  const auto at = element.child("pose");
  if (!at) {
    return otherwise;
  }
  const std::string named = at->attribute("relative_to").value_or(at->attribute("frame").value_or(""));
  return named.empty() ? otherwise : named;
}

Eigen::Isometry3d SdfFrames::frame(const std::string& name, const XmlPlace& user) const {
  std::set<std::string> on_the_way;
  return resolved(name, user, on_the_way);
}

Eigen::Isometry3d SdfFrames::resolved(const std::string& name, const XmlPlace& user,
                                      std::set<std::string>& on_the_way) const {
  if (name.empty() || name == "__model__") {
    return Eigen::Isometry3d::Identity();
  }
  const auto found = frames_.find(name);
  if (found == frames_.end()) {
    std::vector<std::string> names;
    for (const auto& [known, frame] : frames_) {
      names.push_back(known);
    }
    user.fail("there is no link, joint or frame " + shown(name) + did_you_mean(name, names));
  }
  if (!on_the_way.insert(name).second || on_the_way.size() > 1000) {
    user.fail("its pose is relative to itself in the end: expected a chain that ends at the model");
  }
  return resolved(found->second.relative_to, found->second.place, on_the_way) * found->second.pose;
}

}  // namespace wheelwright

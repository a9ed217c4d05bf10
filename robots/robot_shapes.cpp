// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/robots/robot_shapes.hpp>

namespace wheelwright {

Eigen::Isometry3d pose(const Eigen::Vector3d& translation, const Eigen::Vector3d& roll_pitch_yaw) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translation() = translation;
  out.linear() = (Eigen::AngleAxisd(roll_pitch_yaw.z(), Eigen::Vector3d::UnitZ()) *
                  Eigen::AngleAxisd(roll_pitch_yaw.y(), Eigen::Vector3d::UnitY()) *
                  Eigen::AngleAxisd(roll_pitch_yaw.x(), Eigen::Vector3d::UnitX()))
                     .toRotationMatrix();
  return out;
}

Eigen::Matrix3d symmetric(const Eigen::Vector3d& moments, const Eigen::Vector3d& products) {
  Eigen::Matrix3d out = moments.asDiagonal();
  out(0, 1) = out(1, 0) = products.x();
  out(0, 2) = out(2, 0) = products.y();
  out(1, 2) = out(2, 1) = products.z();
  return out;
}

TreeShape read_shape(const XmlPlace& body, bool collision, const Eigen::Isometry3d& at,
                     const std::function<double(const XmlPlace&)>& radius) {
  TreeShape out{body.name(), collision, 0.0, at.translation(), at.linear().col(2), body.place()};
  out.place.element = std::string(collision ? "collision " : "visual ") + out.place.element;
  if (out.kind == "cylinder" || out.kind == "sphere") {
    out.radius = radius(body);
    if (!(out.radius > 0.0)) {
      body.fail("radius " + std::to_string(out.radius) + ": expected metres, > 0");
    }
  }
  return out;
}

void move(TreeLink& link, const Eigen::Isometry3d& frame) {
  if (link.inertial) {
    link.inertial->centre = frame * link.inertial->centre;
    link.inertial->tensor = frame.linear() * link.inertial->tensor * frame.linear().transpose();
  }
  for (TreeShape& shape : link.shapes) {
    shape.centre = frame * shape.centre;
    shape.axis = frame.linear() * shape.axis;
  }
}

}  // namespace wheelwright

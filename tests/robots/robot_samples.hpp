// SPDX-License-Identifier: Apache-2.0
/// \file
/// A small robot of boxes and cylinders, as URDF, whose frames may stand anyhow.
#pragma once

#include <cmath>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Geometry>

namespace wheelwright::testing {

/// A body of the sample robot in the robot's frame: a box, or a cylinder along its own z.
struct SampleBody {
  std::string name;
  double mass = 0.0;
  Eigen::Vector3d size{0, 0, 0};  ///< box: edges; cylinder: radius, length, 0
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();

  [[nodiscard]] bool round() const { return size.z() == 0.0; }
  /// Principal moments, closed form.
  [[nodiscard]] Eigen::Vector3d moments() const {
    const Eigen::Vector3d s = size.cwiseAbs2();
    return round() ? Eigen::Vector3d(mass * (3.0 * s.x() + s.y()) / 12.0, mass * (3.0 * s.x() + s.y()) / 12.0,
                                     mass * s.x() / 2.0)
                   : Eigen::Vector3d(mass / 12.0 * Eigen::Vector3d(s.y() + s.z(), s.x() + s.z(), s.x() + s.y()));
  }
};

inline Eigen::Isometry3d placed(const Eigen::Vector3d& at, const Eigen::Quaterniond& turned) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translation() = at;
  out.linear() = turned.normalized().toRotationMatrix();
  return out;
}

/// Numbers of the sample robot.
struct SampleRobot {
  double radius = 0.05, track = 0.38, damping = 0.02, friction = 0.0;
  SampleBody base{"base_link", 10.0, {0.4, 0.3, 0.2}, placed({0.03, 0.0, 0.1}, Eigen::Quaterniond::Identity())};
  SampleBody mast{"mast", 1.5, {0.02, 0.6, 0}, placed({-0.1, 0.02, 0.5}, Eigen::Quaterniond(1.0, 0.1, -0.2, 0.3))};
  double wheel_mass = 0.5, wheel_length = 0.02;

  [[nodiscard]] SampleBody wheel(double side) const {
    const Eigen::Quaterniond lying(Eigen::AngleAxisd(-M_PI / 2.0, Eigen::Vector3d::UnitX()));
    return {side > 0 ? "left_wheel" : "right_wheel",
            wheel_mass,
            {radius, wheel_length, 0},
            placed({0.0, 0.5 * side * track, radius}, lying)};
  }
  [[nodiscard]] std::vector<SampleBody> bodies() const { return {base, mast, wheel(1.0), wheel(-1.0)}; }

  /// Sum of the masses.
  [[nodiscard]] double mass() const { return base.mass + mast.mass + 2.0 * wheel_mass; }
  /// Of both wheels about their axle.
  [[nodiscard]] double spin() const { return wheel_mass * radius * radius; }
  /// About the vertical through the middle of the axle.
  [[nodiscard]] double yaw_inertia() const {
    double out = 0.0;
    for (const SampleBody& body : bodies()) {
      const Eigen::Matrix3d turned = body.pose.linear();
      const Eigen::Vector3d at = body.pose.translation();
      out += (turned * body.moments().asDiagonal() * turned.transpose())(2, 2);
      out += body.mass * (at.x() * at.x() + at.y() * at.y());
    }
    return out;
  }
  /// Of the centre of mass before the axle.
  [[nodiscard]] double ahead() const {
    double out = 0.0;
    for (const SampleBody& body : bodies()) {
      out += body.mass * body.pose.translation().x();
    }
    return out / mass();
  }
};

/// xyz and rpy, R = Rz Ry Rx.
struct SamplePose {
  Eigen::Vector3d xyz, rpy;
  explicit SamplePose(const Eigen::Isometry3d& t) : xyz(t.translation()) {
    const Eigen::Matrix3d r = t.linear();
    rpy = {std::atan2(r(2, 1), r(2, 2)), std::asin(std::clamp(-r(2, 0), -1.0, 1.0)), std::atan2(r(1, 0), r(0, 0))};
  }
  [[nodiscard]] std::string urdf() const {
    return fmt::format(R"(<origin xyz="{:.17g} {:.17g} {:.17g}" rpy="{:.17g} {:.17g} {:.17g}"/>)", xyz.x(), xyz.y(),
                       xyz.z(), rpy.x(), rpy.y(), rpy.z());
  }
};

/// Where the frames of the links stand, in the robot's frame; that of the root is the robot's own.
using SampleFrames = std::map<std::string, Eigen::Isometry3d>;

/// Frames at the bodies' own, the usual ones.
inline SampleFrames usual_frames(const SampleRobot& robot) {
  SampleFrames out;
  for (const SampleBody& body : robot.bodies()) {
    out[body.name] = body.name == "base_link" ? Eigen::Isometry3d::Identity() : body.pose;
  }
  return out;
}

/// Frames anywhere on the wheels' axles, and anywhere at all for the other links.
inline SampleFrames random_frames(const SampleRobot& robot, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  SampleFrames out = usual_frames(robot);
  for (auto& [name, frame] : out) {
    const Eigen::Quaterniond turned(normal(random), normal(random), normal(random), normal(random));
    if (name == "mast") {
      frame = placed({normal(random), normal(random), normal(random)}, turned);
    } else if (name != "base_link") {
      frame = placed(frame.translation(), turned);
    }
  }
  return out;
}

/// The sample robot as URDF.
inline std::string sample_urdf(const SampleRobot& robot, const SampleFrames& frames, const std::string& more = "") {
  std::string out = "<?xml version=\"1.0\"?>\n<robot name=\"sample\">\n<link name=\"base_footprint\"/>\n";
  out += R"(<joint name="base_joint" type="fixed"><parent link="base_footprint"/><child link="base_link"/></joint>)"
         "\n";
  for (const SampleBody& body : robot.bodies()) {
    const Eigen::Isometry3d& frame = frames.at(body.name);
    const std::string origin = SamplePose(frame.inverse() * body.pose).urdf();
    const Eigen::Vector3d j = body.moments();
    const std::string shape =
        body.round() ? fmt::format(R"(<cylinder radius="{}" length="{}"/>)", body.size.x(), body.size.y())
                     : fmt::format(R"(<box size="{} {} {}"/>)", body.size.x(), body.size.y(), body.size.z());
    out += fmt::format(
        "<link name=\"{}\">\n<inertial>\n{}\n<mass value=\"{:.17g}\"/>\n<inertia ixx=\"{:.17g}\" ixy=\"0\" ixz=\"0\" "
        "iyy=\"{:.17g}\" iyz=\"0\" izz=\"{:.17g}\"/>\n</inertial>\n<collision>{}<geometry>{}</geometry></collision>\n"
        "</link>\n",
        body.name, origin, body.mass, j.x(), j.y(), j.z(), origin, shape);
    if (body.name == "base_link") {
      continue;
    }
    const bool wheel = body.name != "mast";
    const Eigen::Vector3d axis = frame.linear().transpose() * Eigen::Vector3d::UnitY();
    const std::string turning = fmt::format(
        "<axis xyz=\"{:.17g} {:.17g} {:.17g}\"/>\n<dynamics damping=\"{}\" friction=\"{}\"/>\n<limit effort=\"6\" "
        "velocity=\"12\"/>\n",
        axis.x(), axis.y(), axis.z(), robot.damping, robot.friction);
    out += fmt::format(
        "<joint name=\"{}_joint\" type=\"{}\">\n<parent link=\"base_link\"/>\n<child link=\"{}\"/>\n{}\n{}</joint>\n",
        body.name, wheel ? "continuous" : "fixed", body.name, SamplePose(frame).urdf(), wheel ? turning : "");
  }
  return out + more + "</robot>\n";
}

/// The parameters of its controller.
inline const std::string sample_controller = R"(controller_manager:
  ros__parameters:
    update_rate: 100
    diff_drive_controller:
      type: diff_drive_controller/DiffDriveController
diff_drive_controller:
  ros__parameters:
    left_wheel_names: ["left_wheel_joint"]
    right_wheel_names: ["right_wheel_joint"]
    wheel_separation: 0.19
    wheel_separation_multiplier: 2.0
    wheel_radius: 0.05
    publish_rate: 50.0
    linear.x.has_velocity_limits: true
    linear.x.max_velocity: 0.5
    angular:
      z:
        has_velocity_limits: true
        max_velocity: 1.9
        has_acceleration_limits: false
        max_acceleration: 1.0
)";

}  // namespace wheelwright::testing

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Robot descriptions: links and joints in one frame; URDF.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Geometry>

#include "formats/files/place.hpp"

namespace wheelwright::robots {

/// Mass of a link and how it is spread.
struct TreeInertial {
  double mass = 0.0;                                 ///< kg
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of mass, m, in the robot's frame
  Eigen::Matrix3d tensor = Eigen::Matrix3d::Zero();  ///< about the centre of mass, kg·m², in the robot's axes
  files::FilePlace place;                            ///< of the inertial
};

/// A collision or visual shape of a link.
struct TreeShape {
  std::string kind;                                  ///< "cylinder", "sphere", "mesh", "box", ...
  bool collision = true;                             ///< else visual
  double radius = 0.0;                               ///< m; cylinder and sphere
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< m, in the robot's frame
  Eigen::Vector3d axis = Eigen::Vector3d::UnitZ();   ///< of a cylinder, in the robot's frame
  files::FilePlace place;                            ///< of the <cylinder>, <mesh>, ...
};

/// A body.
struct TreeLink {
  std::string name;
  std::optional<TreeInertial> inertial;
  std::vector<TreeShape> shapes;
  files::FilePlace place;
};

/// A joint; all joints stand at their zero position.
struct TreeJoint {
  std::string name;
  std::string type;                                  ///< as URDF calls it: fixed, continuous, revolute, ...
  std::string parent;                                ///< name of a link
  std::string child;                                 ///< name of a link
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  ///< m, in the robot's frame
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();   ///< unit, in the robot's frame
  std::optional<files::OriginNumber> damping;        ///< N·m·s/rad
  std::optional<files::OriginNumber> friction;       ///< dry, N·m
  std::optional<files::OriginNumber> effort;         ///< limit, N·m
  std::optional<files::OriginNumber> velocity;       ///< limit, rad/s
  files::FilePlace place;
};

/// Data of a differential drive from a simulator's plugin or a controller's parameters.
struct DriveFacts {
  std::vector<std::string> left, right;                 ///< names of joints
  std::optional<files::OriginNumber> wheel_radius;      ///< m
  std::optional<files::OriginNumber> track_width;       ///< m, times its multiplier
  double track_multiplier = 1.0;                        ///< that is in it
  std::optional<files::OriginNumber> speed;             ///< limit of |v1|, m/s
  std::optional<files::OriginNumber> yaw_rate;          ///< limit of |v2|, rad/s
  std::optional<files::OriginNumber> acceleration;      ///< limit of |v̇1|, m/s²
  std::optional<files::OriginNumber> yaw_acceleration;  ///< limit of |v̇2|, rad/s²
  std::optional<files::OriginNumber> wheel_effort;      ///< limit, N·m
  std::vector<std::string> remarks;  ///< what a reader of the robot file may want to know, with its place
  files::FilePlace place;
};

/// Data of a joint from a <ros2_control> or <transmission> element.
struct JointInterfaces {
  std::string joint;
  std::vector<std::string> commands;             ///< "velocity", "effort", ...
  std::vector<std::string> states;               ///< what is measured
  std::optional<files::OriginNumber> reduction;  ///< motor turns per turn of the joint
  files::FilePlace place;
};

/// A robot description in the frame of the root link: x ahead, y to the left, z up, as ROS has it (REP 103).
struct RobotTree {
  std::string name;
  std::vector<TreeLink> links;
  std::vector<TreeJoint> joints;
  std::vector<DriveFacts> plugins;
  std::vector<JointInterfaces> interfaces;
  std::optional<files::OriginNumber> encoder_counts;  ///< per turn, of a <ros2_control> hardware parameter
  files::FilePlace place;                             ///< of the <robot> or <model>

  /// The link called `wanted`; nullptr where there is none.
  [[nodiscard]] const TreeLink* link(const std::string& wanted) const;
  /// The joint called `wanted`; nullptr where there is none.
  [[nodiscard]] const TreeJoint* joint(const std::string& wanted) const;
};

/// Throws InputError, naming file, line and element, unless `inertial` is that of a body: finite; mass > 0, or 0 with a
/// tensor of zeros; principal moments >= 0 and none larger than the sum of the others (a thousandth of the largest
/// apart, since files are rounded).
void require_possible(const TreeInertial& inertial);

/// Throws InputError unless the names of links and joints stand there once, the joints make one tree of the links, and
/// there are at most 5,000 of each, and 200 joints between a link and the root.
void require_tree(const RobotTree& tree);

/// Translation (m) and R = Rz(yaw) Ry(pitch) Rx(roll) (rad).
[[nodiscard]] Eigen::Isometry3d pose(const Eigen::Vector3d& translation, const Eigen::Vector3d& roll_pitch_yaw);

/// The tensor of the moments xx, yy, zz and the products xy, xz, yz.
[[nodiscard]] Eigen::Matrix3d symmetric(const Eigen::Vector3d& moments, const Eigen::Vector3d& products);

/// The shape `body`, a <cylinder>, <sphere>, <mesh>, ... at `at` in the frame of its link. `radius` reads the radius of
/// a cylinder or sphere. Throws InputError, naming file, line and element, unless that is > 0.
[[nodiscard]] TreeShape read_shape(const files::XmlPlace& body, bool collision, const Eigen::Isometry3d& at,
                                   const std::function<double(const files::XmlPlace&)>& radius);

/// Takes inertial and shapes of `link` from its own frame into the one in which `frame` is that frame.
void move(TreeLink& link, const Eigen::Isometry3d& frame);

/// Reads a URDF file: links with inertials and shapes, joints with dynamics and limits, <transmission> and
/// <ros2_control> interfaces, differential-drive plugins inside <gazebo>. Origins are composed from the root link
/// through the joints at their zero positions: T_child = T_parent · T_origin, with the fixed-axis angles R = Rz(yaw)
/// Ry(pitch) Rx(roll). An origin that is left out is the identity, and an axis (1, 0, 0), as URDF has it; nothing else
/// has a default. Throws InputError, naming file, line and element, for what is not there or makes no sense, and for
/// xacro, which has to be expanded first.
[[nodiscard]] RobotTree read_urdf(const std::filesystem::path& path);

/// The same from text; `file` is for messages.
[[nodiscard]] RobotTree parse_urdf(std::string_view text, const std::string& file);

}  // namespace wheelwright::robots

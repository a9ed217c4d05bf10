// SPDX-License-Identifier: Apache-2.0
/// \file
/// Poses and shapes, as URDF and SDF have them in common.
#pragma once

#include <functional>

#include <Eigen/Geometry>

#include <wheelwright/files/xml_place.hpp>
#include <wheelwright/robots/robot_tree.hpp>

namespace wheelwright {

/// Translation (m) and R = Rz(yaw) Ry(pitch) Rx(roll) (rad).
[[nodiscard]] Eigen::Isometry3d pose(const Eigen::Vector3d& translation, const Eigen::Vector3d& roll_pitch_yaw);

/// The tensor of the moments xx, yy, zz and the products xy, xz, yz.
[[nodiscard]] Eigen::Matrix3d symmetric(const Eigen::Vector3d& moments, const Eigen::Vector3d& products);

/// The shape `body`, a <cylinder>, <sphere>, <mesh>, ... at `at` in the frame of its link. `radius` reads the radius of a
/// cylinder or sphere. Throws InputError, naming file, line and element, unless that is > 0.
[[nodiscard]] TreeShape read_shape(const XmlPlace& body, bool collision, const Eigen::Isometry3d& at,
                                   const std::function<double(const XmlPlace&)>& radius);

/// Takes inertial and shapes of `link` from its own frame into the one in which `frame` is that frame.
void move(TreeLink& link, const Eigen::Isometry3d& frame);

}  // namespace wheelwright

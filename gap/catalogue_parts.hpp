// SPDX-License-Identifier: Apache-2.0
/// \file
/// What the effects of the catalogue are made of; useful for effects of one's own too.
#pragma once

#include <cstddef>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/gap/effect.hpp>

namespace wheelwright::catalogue {

/// Standard deviation of a signal.
[[nodiscard]] double deviation(const Eigen::VectorXd& signal);

/// sgn(signal), as tanh(signal/width).
[[nodiscard]] Eigen::VectorXd soft_sign(const Eigen::VectorXd& signal, double width);

/// Width for the sign of a joint's speed, rad/s: 0.6 % of the first joint's typical speed or 0.4 of a count.
[[nodiscard]] double sign_width(const Drive& drive);

/// Soft sign of the joint's smooth speed.
[[nodiscard]] Eigen::VectorXd speed_sign(const Drive& drive, std::size_t joint);

/// Typical speed of the joints (standard deviation of the first one's), rad/s; > 0.
[[nodiscard]] double typical_speed(const Drive& drive);

/// The column of additional efforts at the joints (empty ones stand for zeros): Model::input times them.
[[nodiscard]] Column at_joints(const Drive& drive, const std::vector<Eigen::VectorXd>& effort);

/// The column of the derivatives of such efforts.
[[nodiscard]] Column rate_at_joints(const Drive& drive, const std::vector<Eigen::VectorXd>& effort);

/// function(j) for every joint j.
template <typename Function>
[[nodiscard]] std::vector<Eigen::VectorXd> each_joint(const Drive& drive, const Function& function) {
  std::vector<Eigen::VectorXd> signals;
  for (std::size_t j = 0; j < drive.joints.size(); ++j) {
    signals.push_back(function(j));
  }
  return signals;
}

/// A signal at one joint, empty ones at the others.
[[nodiscard]] std::vector<Eigen::VectorXd> only(const Drive& drive, std::size_t joint, Eigen::VectorXd signal);

/// The column of a robot whose coordinates move faster than its joints show, by `speed` (one signal per coordinate, empty
/// for zeros): the base model's effort for that motion; for a robot on wheels also its body velocity. Without `friction` only
/// its inertia: friction in the joints knows nothing of what they do not show. Terms of the base model that are functions
/// of the motion are taken as they are.
[[nodiscard]] Column unseen_motion(const Drive& drive, const std::vector<Eigen::VectorXd>& speed, bool friction);

/// The same for wheels whose rims move faster by `right` and `left`, m/s.
[[nodiscard]] Column unseen_rim_speeds(const Drive& drive, const Eigen::VectorXd& right, const Eigen::VectorXd& left,
                                       bool friction);

/// The joints' efforts of the base model's inertial terms on the smooth motion.
[[nodiscard]] std::vector<Eigen::VectorXd> inertial_efforts(const Drive& drive);

/// Base regressor column of the parameter with the physical name `name`, per physical unit; zeros where the model has
/// none of this name. Terms that are functions of the motion are left out.
[[nodiscard]] Column base_column(const Drive& drive, std::string_view name);

/// a += b, signal by signal.
void add(Column& a, const Column& b);

/// The shape that chooses one of two joints: 0 or 1 (right, left).
[[nodiscard]] ShapeParameter side();

/// The shape of an effect of one wheel (0 right, 1 left) or of both with opposite signs (2).
[[nodiscard]] ShapeParameter side_or_opposite();

/// The signals of that shape: `right`, `left` or [right, −left]; empty where a wheel has none.
[[nodiscard]] std::vector<Eigen::VectorXd> on_side(double side, const Eigen::VectorXd& right,
                                                   const Eigen::VectorXd& left);

/// Applies where a robot has two driven wheels.
[[nodiscard]] Applicability needs_two_wheels(const Drive& drive);
/// Applies where a robot has two driven wheels and the log a heading.
[[nodiscard]] Applicability needs_heading(const Drive& drive);
/// Applies where the base model has no parameter of the physical name `name`, which would be the same column.
[[nodiscard]] Applicability needs_no(const Drive& drive, std::string_view name);

}  // namespace wheelwright::catalogue

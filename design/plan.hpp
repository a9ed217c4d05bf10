// SPDX-License-Identifier: Apache-2.0
/// \file
/// A planned motion, sample by sample, and how much of each limit it uses.
#pragma once

#include <cstddef>

#include <Eigen/Core>

#include <wheelwright/core/log.hpp>
#include <wheelwright/design/limits.hpp>
#include <wheelwright/design/subject.hpp>

namespace wheelwright {

/// A motion at times 0, step, 2·step, …; it starts at the pose [0, 0, 0].
struct Plan {
  double step = 0.0;             ///< s
  Eigen::MatrixXd speed;         ///< coordinates × samples, m/s and rad/s
  Eigen::MatrixXd acceleration;  ///< its derivative, m/s² and rad/s²
  Eigen::Matrix3Xd pose;         ///< [x, y, θ], m, m, rad; a single axis: [position, 0, 0]

  /// Number of samples.
  [[nodiscard]] Eigen::Index samples() const { return speed.cols(); }
  /// Time of sample `k`, s.
  [[nodiscard]] double t(Eigen::Index k) const { return step * static_cast<double>(k); }
};

/// Largest use of each limit as a share of it: <= 1 within the limits; 0 where there is no limit.
struct LimitUse {
  double speed = 0.0;
  double acceleration = 0.0;
  double effort = 0.0;  ///< worst case over DesignSubject::effort_box
  double space = 0.0;

  /// The largest share.
  [[nodiscard]] double largest() const;
};

/// Fills `plan.pose` from `plan.speed`: an arc of the mean twist from sample to sample, as wheels roll (error O(step³) a
/// step).
void integrate_pose(Plan& plan, const Model& model);

/// How much of `limits` `plan` uses at its samples.
[[nodiscard]] LimitUse limit_use(const Plan& plan, const DesignSubject& subject, const MotionLimits& limits);

/// How much of the space `plan` uses, as LimitUse::space.
[[nodiscard]] double space_use(const Plan& plan, const MotionLimits& limits);

/// Speeds of the joints, joints × samples, rad/s (or m/s): what is commanded.
[[nodiscard]] Eigen::MatrixXd joint_speeds(const Plan& plan, const Model& model);

/// The table to be driven. Differential drive: t, command_r, command_l (rad/s), v1 (m/s), v2 (rad/s), x, y (m), theta
/// (rad). One joint: t, command (rad/s or m/s), position (rad or m). Throws InvalidArgument for other models.
[[nodiscard]] LogTable command_table(const Plan& plan, const Model& model);

}  // namespace wheelwright

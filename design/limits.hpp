// SPDX-License-Identifier: Apache-2.0
/// \file
/// What a manoeuvre must keep to.
#pragma once

#include <array>
#include <optional>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// Limits of a manoeuvre. What is not given does not limit; a speed is needed, and an acceleration or an effort, since
/// motion has no scale without.
struct MotionLimits {
  double duration = 20.0;                      ///< s, rests at both ends included
  double joint_speed = 0.0;                    ///< of each wheel (or of the axis), > 0, rad/s (or m/s)
  std::optional<double> joint_acceleration;    ///< of each wheel, > 0, rad/s² (or m/s²)
  std::optional<double> effort;                ///< of each wheel, > 0, unit of the effort: N·m, A or V
  std::optional<double> radius;                ///< largest distance from the start, m (a single axis: travel, its unit)
  std::optional<std::array<Interval, 2>> box;  ///< x (ahead of the start) and y (to its left), m; holds [0, 0]
};

/// Limits as the robot file has them: `limits: {speed, acceleration, effort}`, those of a wheel, rad/s, rad/s² and the
/// unit of the effort. The rest keeps its default.
[[nodiscard]] MotionLimits limits_of(const Robot& robot);

/// Throws InvalidArgument, naming the field, unless all limits are > 0, the box holds the start in its interior, and
/// there is a limit on speed and one on acceleration or effort.
void validate(const MotionLimits& limits);

}  // namespace wheelwright

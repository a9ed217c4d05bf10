// SPDX-License-Identifier: Apache-2.0
/// \file
/// Survey of a log in one pass before any fit: duration, regularity of the steps, motion of the joints.
#pragma once

#include <cstddef>
#include <vector>

#include "core/log.hpp"
#include "model/filter/measurement.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {

/// Properties of a log.
struct Survey {
  std::size_t rows = 0;
  std::size_t segments = 0;
  double seconds = 0.0;               ///< driving time, gaps left out
  double longest_segment = 0.0;       ///< s
  double median_step = 0.0;           ///< s
  double largest_step = 0.0;          ///< within a segment, s
  std::size_t losses = 0;             ///< steps within a segment of 1.5 to 6.5 median ones
  double losses_scatter = 0.0;        ///< standard deviation of the rows between two losses over their mean: near
                                      ///< 1 where rows are lost at random, 0 where each n-th step is a long one
  std::vector<double> largest_speed;  ///< per joint, |speed|, rad/s or m/s
  std::vector<double> largest_acceleration;  ///< per joint, over windows of kSurveyWindow steps, rad/s² or m/s²
  std::vector<double> sharpest_change;       ///< per joint, from one step to the next, of the speed over time, noise
                                             ///< and all, rad/s² or m/s²
  std::vector<double> change_noise;  ///< per joint, standard deviation of what noise alone makes of a speed from
                                     ///< one step to the next, by third differences of at most 65,536 speeds
  std::vector<double> reversals;     ///< per joint: how often its speed changed sign
};

/// Whether rows are lost more often than twice a second, and at random (Survey::losses_scatter above a half): between
/// most losses no row of the filter is settled then. Steps that are long at even distances are the log's own.
[[nodiscard]] bool loses_often(const Survey& survey);

/// What the noise of the samples alone may show as the largest acceleration of joint `j` from one step to the next:
/// errors of `motion_error` (of the motion column, rad or rad/s), or the largest that `change_noise` makes in so many
/// rows, whichever is more, over a step as short as `shortest_step` has it, but not below half the median.
[[nodiscard]] double acceleration_by_noise(const Survey& survey, std::size_t j, MotionKind motion, double motion_error,
                                           double shortest_step);

/// Acceleration is measured over windows of ten steps: unfiltered differences would show the encoder, not the robot.
inline constexpr std::size_t kSurveyWindow = 10;

/// Walks `log` once.
[[nodiscard]] Survey survey(LogSource& log, const Measurement& measurement);

/// Limit on the acceleration of each joint at every instant, rad/s² (m/s²): limits.acceleration of the robot file where
/// it has one, else kBeyondSamples times the largest that the samples show, those of windows and those of single steps
/// less what errors of `motion_error` (of the motion column, rad or rad/s) may have put there. Without a declaration
/// this is an assumption: that the motion between samples is no rougher than that.
[[nodiscard]] std::vector<double> acceleration_limit(const Robot& robot, const Survey& survey, MotionKind motion,
                                                     double motion_error);

/// Of acceleration_limit().
inline constexpr double kBeyondSamples = 4.0;

}  // namespace wheelwright::commission

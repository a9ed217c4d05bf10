// SPDX-License-Identifier: Apache-2.0
/// \file
/// One walk over a log before anything is fitted: how long, how even, how the joints moved.
#pragma once

#include <cstddef>
#include <vector>

#include <wheelwright/core/log.hpp>
#include <wheelwright/filter/measurement.hpp>

namespace wheelwright {

/// What a log is like.
struct Survey {
  std::size_t rows = 0;
  std::size_t segments = 0;
  double seconds = 0.0;                      ///< driving time, gaps left out
  double longest_segment = 0.0;              ///< s
  double median_step = 0.0;                  ///< s
  double largest_step = 0.0;                 ///< within a segment, s
  std::vector<double> largest_speed;         ///< per joint, |speed|, rad/s or m/s
  std::vector<double> largest_acceleration;  ///< per joint, over windows of `smoothing` steps, rad/s² or m/s²
  std::vector<double> reversals;             ///< per joint: how often its speed changed sign
};

/// Acceleration is measured over windows of ten steps: unfiltered differences would show the encoder, not the robot.
inline constexpr std::size_t kSurveyWindow = 10;

/// Walks `log` once.
[[nodiscard]] Survey survey(LogSource& log, const Measurement& measurement);

/// What linear interpolation between samples may add to the error of the motion column: a·h²/8 for angles and mean
/// speeds (rad), with the largest acceleration seen and the largest step; for speeds the like with the largest jerk is
/// below the noise of any encoder and is taken as a·h/8 times the ratio of step to window (rad/s).
[[nodiscard]] double interpolation_error(const Survey& survey, MotionKind motion);

}  // namespace wheelwright

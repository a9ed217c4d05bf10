// SPDX-License-Identifier: Apache-2.0
/// \file
/// Origin of a pose: an independent measurement, or wheel odometry.
#pragma once

#include <string>

#include "core/log.hpp"
#include "model/filter/odometry_filter.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {

/// Agreement of the pose of a log with the wheel angles.
struct PoseOrigin {
  bool heading_repeats = false;   ///< theta is a combination of the wheel angles
  bool position_repeats = false;  ///< x, y advance by a combination of the wheel angles
  bool undecided = false;         ///< it may be a measurement of its own whose errors are as small
  double heading_rest = 0.0;      ///< rad, rms over windows of what the wheels leave of the heading
  double position_rest = 0.0;     ///< m, the same of the way travelled
  std::string sentence;           ///< for people; empty where nothing repeats
};

/// Compares the change of heading over windows of `window` seconds with the best combination of the changes of both
/// wheel angles (speeds are integrated by the rectangle before, the rectangle after and the trapezium, whichever fits
/// best), and the length of the way with another one.
///
/// A heading repeats the wheels where less is left than 10⁻⁶ rad rms, which no sensor of its own would agree to with
/// wheels on a floor; or where no more is left than the rounding of the heading's decimals, and that is less than a
/// third of what the wheels' own counts (where they are known: half a count each) would leave of an independent
/// heading. Poses that have stamps of their own repeat the wheels, too (of the first 200,000 rows): where less than
/// 10⁻⁶ rad rms is left from one rest of the wheels to the next (four and more of these), since there no stamp, hold or
/// lag matters; or where no window leaves more than h²/8·|θ̈| at both its ends, the error of lines between samples h
/// apart, θ̈ by the wheels: no sensor of its own stays within that where the robot hardly accelerates. Counts of the
/// wheels are allowed for there, unless the heading's second differences are 1.2 times what these counts make, which is
/// noise of its own. With fewer than four windows where all that is below 10⁻⁵ rad, an accurate sensor may do the same:
/// this is undecided, and where the robot's pose_source is independent nothing is claimed. A way repeats the wheels
/// below 10⁻⁵ m, and where the heading does. Nothing is claimed of fewer than eight windows, or of a robot that hardly
/// turns (drives). Walks `log` once.
[[nodiscard]] PoseOrigin pose_origin(LogSource& log, const filter::OdometryMeasurement& measurement, double window,
                                     const model::Robot& robot);

}  // namespace wheelwright::commission

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Kinematic calibration: wheel radii and track width from wheel speeds and pose.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "core/log.hpp"

namespace wheelwright::inference {

/// Search options and starting values.
struct KinematicOptions {
  double wheel_radius = 0.0;   ///< nominal r, m (> 0)
  double track_width = 0.0;    ///< nominal D, m (> 0)
  bool radius = true;          ///< whether the mean radius is searched; it needs the position (columns x, y)
  bool asymmetry = true;       ///< whether right and left radius may differ
  bool axle_offset = true;     ///< whether the pose's point may lie ahead of the axle; needs the position
  double largest_delay = 0.0;  ///< s; > 0: the pose may lag behind the wheel speeds by up to this, and the lag is
                               ///< searched. Poses of the first `largest_delay` of a window only start it
  double window = 2.0;         ///< s (> 0): segments of the log are cut into windows no longer than this
  double huber = 5.0;          ///< robust standard deviations (> 0) beyond which a pose counts by its distance, not its
                               ///< square. Wide on purpose: slip makes residuals that are no errors, and a narrow loss
                               ///< would calibrate gentle driving only
  std::size_t fewest_poses = 5;  ///< windows with fewer poses are not used (>= 4)
};

/// Knowledge of one quantity.
enum class KinematicState {
  identified,
  not_identified,  ///< the log does not show it: the estimate is no measurement; `reason` says what to drive
  fixed,           ///< not searched: the nominal value
};

/// One quantity with its 95 % interval.
struct KinematicQuantity {
  KinematicState state = KinematicState::fixed;
  double estimate = 0.0;
  double standard_error = 0.0;  ///< infinite where it is not identified
  double lower = 0.0;           ///< 95 %, Student's t
  double upper = 0.0;
  std::string reason;  ///< one sentence for people, empty where identified or fixed
};

/// Result of calibrate_kinematics().
struct KinematicCalibration {
  bool converged = false;
  std::size_t windows = 0;                    ///< that were used
  std::size_t poses = 0;                      ///< that were used
  std::size_t held_poses = 0;                 ///< left out: exactly the pose before it (a slower sensor's value held)
  std::size_t outlying_poses = 0;             ///< beyond three times the robust spread: of little weight
  KinematicQuantity radius_right;             ///< r_R, m
  KinematicQuantity radius_left;              ///< r_L, m
  KinematicQuantity track_width;              ///< D, m, with the radii above
  KinematicQuantity track_at_nominal_radius;  ///< D·r/r̂, m: what turns the robot as the log shows where the mean
                                              ///< radius is taken to be the nominal one. The heading alone tells it
  KinematicQuantity radius_scale;             ///< r̂/r: longitudinal scale (1 without slip and with the right radius)
  KinematicQuantity asymmetry;                ///< (r_R − r_L)/(r_R + r_L)
  KinematicQuantity axle_offset;              ///< m: the pose's point is ahead of the point that does not move sideways
  KinematicQuantity delay;                    ///< s: of the pose
  double heading_spread = 0.0;                ///< robust standard deviation of the heading residual, rad
  double position_spread = 0.0;               ///< of each coordinate's residual, m; 0 without position
  double freedom = 0.0;                       ///< degrees of freedom of Student's t
};

/// Fits v = (r_R ω_R + r_L ω_L)/2, θ̇ = (r_R ω_R − r_L ω_L)/D to the columns omega_r, omega_l, theta (and x, y where
/// the log has them), window by window: each has a start pose of its own, so that nothing is drawn across a gap or from
/// an absolute heading, and errors of the pose do not add up. Wheel speeds are linear between samples. Poses enter with
/// Huber's loss (Huber 1964), scaled by robust standard deviations that are found from the residuals: single wrong
/// poses have bounded influence. Headings may be wrapped or not.
///
/// Intervals: residuals are alike within a window (slip) and, in driving under one command, from window to window. The
/// covariance is the sandwich of the windows' scores, each scored as if it had been left out (the jackknife). Of their
/// long-run covariance over windows in order of time (block_sums.hpp, with its Student's t) and the covariance that
/// independent windows would have, the larger counts in every direction: neighbours may be alike or opposed.
///
/// Errors in the wheel speeds count only through their integral over a window; noise of some 0.1 rad/s leaves windows
/// that turn by 0.1 rad unbiased to 1 %. A skid-steer robot slips: its effective track is wider than the geometric one,
/// and its effective radius_scale may be below 1; both are averages over the driving in the log.
///
/// Throws InvalidArgument where a column is missing, an option is outside its range, or fewer than 8 windows have
/// enough poses.
[[nodiscard]] KinematicCalibration calibrate_kinematics(const LogTable& log, const KinematicOptions& options);

}  // namespace wheelwright::inference

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Open-loop simulation against a log: the simulator starts at the state of the log, is driven by the measured efforts,
/// and is compared with the log some seconds later.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "gap/rows/drive.hpp"
#include "model/robot.hpp"

namespace wheelwright::gap {

/// Windows over a log.
struct RolloutOptions {
  std::vector<double> horizons = {1.0, 5.0};  ///< s, ascending; the last one is the windows' length
  double every = 3.0;       ///< s from one start to the next, less where there would be fewer than `fewest` windows
  std::size_t fewest = 40;  ///< windows that are wished for
  double closest = 0.25;    ///< s, least distance from one start to the next
  std::size_t threads = 1;  ///< the result does not depend on it
};

/// Errors of the open-loop simulation (simulator minus log) at one horizon, one value per window. Speeds and angles are
/// as the wheels show them through the drive's own geometry.
struct RolloutErrors {
  double horizon = 0.0;      ///< s
  Eigen::VectorXd velocity;  ///< v1, m/s
  Eigen::VectorXd yaw_rate;  ///< v2, rad/s
  Eigen::VectorXd position;  ///< distance, m
  Eigen::VectorXd heading;   ///< rad
};

/// A root mean square over windows with its 95 % interval.
struct RolloutRms {
  double rms = 0.0;
  double lower = 0.0;
  double upper = 0.0;
};

/// Rows at which windows begin: each lies within one segment, with `margin` (s) of the same segment before it and
/// behind it.
[[nodiscard]] std::vector<Eigen::Index> rollout_starts(const Drive& drive, const RolloutOptions& options,
                                                       double margin = 0.0);

/// By how much time a segment must go beyond a window on either side for `robot`: the memory of its actuators, and the
/// lateness of its sensors, s.
[[nodiscard]] double rollout_margin(const Robot& robot);

/// Rolls `robot` out from each of `starts` (rollout_starts with rollout_margin), one result per horizon. The parameters
/// are its nominal values, its effects act as in a Simulation; `drive` is a log of it, which may have been read by a
/// robot file with other numbers. The first state is the log's: wheel speeds and pose smoothed, over the window of the
/// drive; its actuators have had the efforts before. Compared are speeds and pose; where the log has no pose (or no
/// heading), odometry of the wheels on both sides. Throws InvalidArgument for a robot that is not on two driven wheels,
/// has other efforts than torques, or lacks a nominal value.
[[nodiscard]] std::vector<RolloutErrors> rollouts(const Drive& drive, const Robot& robot,
                                                  const std::vector<Eigen::Index>& starts,
                                                  const RolloutOptions& options = {});

/// The same for a robot whose log has other noise than `drive`: what the noise of wheel speeds (`speed`, per joint and
/// row, rad/s) and efforts (`effort`, likewise, unit of the log) alone makes of the errors, found by rolling out with
/// it and without. The end of the log's side has the noise too.
[[nodiscard]] std::vector<RolloutErrors> rollout_noise(const Drive& drive, const Robot& robot,
                                                       const std::vector<Eigen::Index>& starts,
                                                       const std::vector<Eigen::VectorXd>& speed,
                                                       const std::vector<Eigen::VectorXd>& effort,
                                                       const RolloutOptions& options = {});

/// Root mean square of `errors`, with the interval of a moving-block bootstrap (Künsch 1989) over windows in order of
/// time, `length` windows a block, from `seed`.
[[nodiscard]] RolloutRms rollout_rms(const Eigen::VectorXd& errors, std::uint64_t seed, std::size_t length = 2);

}  // namespace wheelwright::gap

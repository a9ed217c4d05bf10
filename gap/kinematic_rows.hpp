// SPDX-License-Identifier: Apache-2.0
/// \file
/// Increments of a robot's pose against wheel odometry, window by window.
#pragma once

#include <vector>

#include <Eigen/Core>

#include <wheelwright/gap/effect.hpp>

namespace wheelwright::gap {

/// Consecutive windows, none across segments.
struct Windows {
  std::vector<Eigen::Index> first;   ///< rows at which windows begin
  std::vector<Eigen::Index> middle;  ///< rows whose heading is the direction of `forward`
  std::vector<Eigen::Index> last;    ///< rows at which they end, each the next one's first
  Eigen::VectorXd t;                 ///< time of their middles, s

  [[nodiscard]] std::size_t size() const { return first.size(); }
};

/// One value per window; a vector is empty where the log cannot tell.
struct Increments {
  Eigen::VectorXd forward;  ///< m, along the heading at the window's middle
  Eigen::VectorXd lateral;  ///< m, to its left
  Eigen::VectorXd yaw;      ///< rad
};

/// Standard deviation of the increments' noise; 0 where it is unknown.
struct IncrementNoise {
  double forward = 0.0;  ///< m
  double lateral = 0.0;  ///< m
  double yaw = 0.0;      ///< rad
};

/// Windows of `length` (s; at least two steps), the remainder of each segment left out. A segment without a whole
/// window has none. Throws InvalidArgument unless `length` is > 0.
[[nodiscard]] Windows make_windows(const Drive& drive, double length = 0.5);

/// Pose minus odometry over each window: with the measured p and θ and the wheels' smooth v1 and v2,
///
///     [forward, lateral] = R(−θ_middle) (p_last − p_first − ∫ v1 [cos θ, sin θ] dt)
///     yaw                = θ_last − θ_first − ∫ v2 dt
///
/// Only yaw for a log with a heading but no position, or with a gyro only (whose ∫ gyro dt stands for the heading);
/// nothing for a log with neither, or a robot without two wheels.
[[nodiscard]] Increments pose_gap(const Drive& drive, const Windows& windows);

/// Increments of a column's body velocity (Column::forward, lateral, yaw): ∫ R(θ) [forward, lateral] dt, turned alike,
/// and ∫ yaw dt. The vectors are empty where those of pose_gap are, and where the column has no such part.
[[nodiscard]] Increments increments_of(const Drive& drive, const Windows& windows, const Column& column);

/// Noise of the increments from that of the pose, by third differences of the pose (a smooth motion leaves none of
/// itself), never below what the pose's resolution makes. Errors of the wheels are not in it.
[[nodiscard]] IncrementNoise pose_noise(const Drive& drive);

/// Part of `gap` that the wheels' motion does not determine: half the mean square difference between windows of nearly
/// the same motion (both coordinates at first, middle and last row, each within a twentieth of its root mean square in
/// the mean), each with its nearest one of another time. A drive with fewer than `fewest` such windows has none to be
/// had. It is what repeated runs would show, the ground's and the pose's own whims included (Rice 1984).
[[nodiscard]] IncrementNoise repeatability(const Drive& drive, const Windows& windows, const Increments& gap,
                                           std::size_t fewest = 30);

}  // namespace wheelwright::gap

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Noise of a drive's signals and the floor that it makes of the filtered rows, without any fit.
#pragma once

#include <cstdint>

#include <Eigen/Core>

#include "gap/rows/drive.hpp"
#include "gap/rows/gap_rows.hpp"

namespace wheelwright::gap {

/// Standard deviations of the raw signals' noise, one per joint.
struct SignalNoise {
  Eigen::VectorXd effort;  ///< unit of the effort
  Eigen::VectorXd speed;   ///< rad/s
  bool counted = false;    ///< speeds are differences of encoder counts: their errors cancel from sample to sample
};

/// Third differences of the signals, of which a smooth motion leaves nothing; robust against jumps (the median of
/// Gaussian noise: uniform noise comes out 5 % too large). Held efforts are taken as they are held. Counted speeds have
/// the error of a uniformly rounded angle, count·h/√12, at both ends of the interval.
[[nodiscard]] SignalNoise signal_noise(const Drive& drive);

/// The floor that `noise` makes through f₂ at `beta`: of the efforts directly, and of the motion through the base
/// model's θ (drive.theta); of the pose as pose_noise() has it over windows of `window` s, with a half of a count of
/// each wheel at both of their ends. Errors of joints and samples are taken as independent. What the sampling step
/// itself leaves is in it: signals are taken as linear between instants, which only matters where there is next to no
/// noise.
[[nodiscard]] NoiseFloor noise_floor(const Drive& drive, const SignalNoise& noise, double beta, double window = 0.5);

/// Draws JointSignals::effort_noise of `drive`: white, of the standard deviations of `noise`, but less where behind f₂
/// at `beta` it would be more than the `floor` is known to, in the mean of the outputs: then what looks like noise of
/// the efforts moves the robot. None where it is next to nothing of the floor, or the drive has no efforts.
void draw_effort_noise(Drive& drive, const SignalNoise& noise, const NoiseFloor& floor, double beta,
                       std::uint64_t seed);

/// By which share the noise of the motion lowers least-squares estimates of inertia: variance of the noise in the
/// filtered accelerations over that of the filtered accelerations, the largest of all coordinates.
[[nodiscard]] double attenuation(const Drive& drive, const SignalNoise& noise, double beta);

/// The largest of 20, 14, 10, 7, 5, 3 and 2 1/s, not above `wish`, at which attenuation stays below `tolerated`; 2
/// where none does.
[[nodiscard]] double choose_gap_beta(const Drive& drive, const SignalNoise& noise, double wish,
                                     double tolerated = 1e-3);

}  // namespace wheelwright::gap

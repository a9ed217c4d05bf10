// SPDX-License-Identifier: Apache-2.0
/// \file
/// Input of a robot, and the motion that follows: efforts held by a controller with a clock of its own, or continuous
/// ones.
#pragma once

#include <cstdint>
#include <vector>

#include "tests/guarantee/plant.hpp"

namespace wheelwright::guarantee {

/// Shape of the efforts over time.
enum class Motion { multisine, chirp, staircase, random_steps, speed_loop, saturated };

/// Behaviour of efforts between the instants at which they are set.
enum class Between { held, linear };

/// One drive. Efforts are set at `ticks` and held, or linear from each to the next.
struct Order {
  Motion motion = Motion::multisine;
  Between between = Between::held;
  double bandwidth = 1.0;  ///< highest frequency of what is asked for, Hz
  Pair reach{1.0, 1.0};    ///< of the efforts in sum and difference, N·m per wheel (axis: first only)
  double speed = 1.0;      ///< of the speed loop's reference, rad/s
  double gain = 0.0;       ///< of the speed loop, N·m per rad/s
  std::uint64_t seed = 1;
};

/// True motion at given instants.
struct History {
  std::vector<double> t;
  std::vector<Pair> angle, speed;
  std::vector<double> ticks;
  std::vector<Pair> effort;  ///< set at each tick
  Between between = Between::held;

  /// The effort that acts at `time`; at a tick the new one.
  [[nodiscard]] Pair effort_at(double time) const;
};

/// Drives a robot from rest at the first tick and looks at it at `instants` (ascending, none before the first tick).
/// `ticks` ascend.
[[nodiscard]] History drive(const Truth& truth, const Order& order, const std::vector<double>& ticks,
                            const std::vector<double>& instants);

}  // namespace wheelwright::guarantee

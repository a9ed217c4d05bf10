// SPDX-License-Identifier: Apache-2.0
/// \file
/// Operating regimes of a drive: the moments at which a cause could show itself more than at others.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/gap/drive.hpp>

namespace wheelwright {

/// Moments of a drive that have something in common.
struct Regime {
  std::string kind;  ///< what was looked at: "speed", "reversal", "heading", …
  std::string name;  ///< the regime in words, e.g. "reversal of the right wheel"
  Mask instants;     ///< one value per instant of the drive
};

/// How finely a drive is divided.
struct RegimeOptions {
  double reversal = 0.3;          ///< s about a change of a joint's direction
  double straight = 0.1;          ///< |yaw rate| below this share of its 95 % quantile counts as straight
  int sectors = 8;                ///< of the heading, and of a wheel's angle
  int grid = 4;                   ///< cells along each side of the positions' bounding box
  int stretches = 10;             ///< of equal duration
  double smallest_share = 0.005;  ///< regimes with a smaller share of the instants are left out
};

/// The regimes of `drive`: speed (standstill, and quarters of the moving instants), yaw rate (straight, and halves to
/// either side), acceleration along the motion, direction and reversal of each joint, effort (quarters of each joint's
/// |effort|), braking (effort against the motion), heading and position (where there is a pose), wheel angle (of a
/// robot on wheels), and time. Regimes of one kind do not overlap, except reversals, directions, efforts, braking and
/// wheel angles, which are each joint's own.
[[nodiscard]] std::vector<Regime> regimes(const Drive& drive, const RegimeOptions& options = {});

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// A commissioning drive: the speeds that the controller is to follow.
#pragma once

#include <cstddef>
#include <vector>

#include <wheelwright/reality/robot.hpp>

namespace wheelwright::reality {

/// Commanded body speeds on a grid of 5 ms, linear in between; they begin and end at rest.
struct Drive {
  static constexpr double step = 0.005;  ///< s
  std::vector<double> v1;                ///< m/s
  std::vector<double> v2;                ///< rad/s

  [[nodiscard]] double duration() const { return step * static_cast<double>(v1.size() - 1); }
};

/// Multi-sines with reversals of both speeds, straights, spins on the spot, figure eights, arcs and stops, in random
/// order and size, for about `duration` seconds, within the wheel speed and acceleration of `robot`.
[[nodiscard]] Drive draw_drive(const RobotDesign& robot, Random& random, double duration);

}  // namespace wheelwright::reality

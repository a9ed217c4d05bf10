// SPDX-License-Identifier: Apache-2.0
/// \file
/// The world: a robot with effects on a commissioning drive (the speeds that its controller is to follow); what
/// happened, without noise.
#pragma once

#include <cstddef>
#include <vector>

#include "tests/world/effect.hpp"
#include "tests/world/robot.hpp"

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

/// Record of one drive, sampling interval by sampling interval. All columns have the same length.
struct Record {
  double period = 0.01;                             ///< s
  std::vector<double> t;                            ///< middle of the interval, s
  std::array<std::vector<double>, 2> angle;         ///< of the encoder at the beginning of the interval, rad; one more
  std::array<std::vector<double>, 2> speed;         ///< mean over the interval, rad/s
  std::array<std::vector<double>, 2> acceleration;  ///< mean over the interval, rad/s²
  std::array<std::vector<double>, 2> torque;        ///< mean command over the interval, N m
  std::vector<double> x, y, heading;                ///< at t; the heading is not wrapped

  [[nodiscard]] std::size_t rows() const { return t.size(); }
};

/// Drives `robot` with `effects` (which are used up) along `drive`, in steps of `step` s. Throws Error when the engine
/// rejects the robot or its state becomes bad.
[[nodiscard]] Record run_world(const RobotDesign& robot, std::vector<Effect>& effects, const Drive& drive,
                               double step = 0.001);

}  // namespace wheelwright::reality

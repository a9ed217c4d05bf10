// SPDX-License-Identifier: Apache-2.0
/// \file
/// The world: a robot with effects, driven; what happened, without noise.
#pragma once

#include <vector>

#include <wheelwright/reality/drive.hpp>
#include <wheelwright/reality/effect.hpp>

namespace wheelwright::reality {

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

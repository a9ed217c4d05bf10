// SPDX-License-Identifier: Apache-2.0
/// \file
/// Interface of an effect on the simulated world.
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <wheelwright/reality/robot.hpp>

namespace wheelwright::reality {

/// The world at one step.
struct State {
  double t = 0.0;        ///< s
  double step = 0.001;   ///< s
  Pair angle{};          ///< of the wheels, rad
  Pair speed{};          ///< of the wheels, rad/s
  Pair torque{};         ///< that reaches the wheels, N m
  double v1 = 0.0;       ///< of the body, m/s
  double v2 = 0.0;       ///< rad/s
  double x = 0.0;        ///< m
  double y = 0.0;        ///< m
  double heading = 0.0;  ///< rad
};

/// Forces that an effect adds.
struct Push {
  Pair wheel{};           ///< torque on the wheels, N m
  double forward = 0.0;   ///< force on the middle of the axle, N
  double sideways = 0.0;  ///< likewise, to the left, N
  double yaw = 0.0;       ///< moment about the middle of the axle, N m
};

/// One effect at one severity, for one run: functions may hold state. Those that are not set do nothing.
struct Effect {
  std::string name;
  std::vector<std::pair<std::string, double>> parameters;  ///< symbols of the catalogue where it has them, SI units
  std::function<void(Body&)> build;                        ///< before the world is made
  std::function<void(const State&, Pair&)> actuate;        ///< commanded torque to torque at the wheel
  std::function<void(const State&, Push&)> push;           ///< forces, once per step
  std::function<void(const State&, Pair&)> measure;        ///< wheel speed to what the encoder turns at
  double late = 0.0;                                       ///< wheel angles are logged so much late, s
};

}  // namespace wheelwright::reality

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Effects on the simulated world: their interface, and all of them by name.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/world/robot.hpp"

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

/// Class of an effect.
enum class Class {
  structural,  ///< leaves something when the nominal model is fitted again
  parametric,  ///< moves parameters of the nominal model
  outside,     ///< not in the catalogue of the tool on purpose
};

/// Makes an effect for `robot`; at severity 1 it makes a gap of the order of 15 per cent of the torque, and its size is
/// proportional to the severity. Directions and shapes are drawn from `random`: equal draws, equal effects.
using MakeEffect = Effect (*)(const RobotDesign& robot, Random random, double severity);

/// An entry.
struct Entry {
  std::string_view name;
  Class kind = Class::structural;
  MakeEffect make = nullptr;
  double largest = 1e9;    ///< severity beyond which it would be no such robot
  bool kinematic = false;  ///< its severity is not judged by the torque
  bool slow = false;       ///< shows in the whole drive only
};

/// All effects, structural ones first.
[[nodiscard]] const std::vector<Entry>& catalogue();

/// The entry of that name. Throws InvalidArgument where there is none.
[[nodiscard]] const Entry& find_entry(std::string_view name);

/// @name Entries, by what they act on
/// @{
[[nodiscard]] std::vector<Entry> friction_effects();
[[nodiscard]] std::vector<Entry> actuator_effects();
[[nodiscard]] std::vector<Entry> body_effects();
[[nodiscard]] std::vector<Entry> kinematic_effects();
[[nodiscard]] std::vector<Entry> parametric_effects();
[[nodiscard]] std::vector<Entry> outside_effects();
/// @}

/// Width of the smooth sign of a wheel's speed, rad/s; smaller than any speed that is driven.
inline constexpr double creep = 0.02;

/// sgn x, smooth within `width`.
[[nodiscard]] double soft_sign(double x, double width);

}  // namespace wheelwright::reality

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The effects of this world, by name.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <wheelwright/reality/effect.hpp>

namespace wheelwright::reality {

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

/// sgn x, smooth within `width`.
[[nodiscard]] double soft_sign(double x, double width);

}  // namespace wheelwright::reality

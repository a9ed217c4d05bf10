// SPDX-License-Identifier: Apache-2.0
/// \file
/// θ_L in the words of a data sheet.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// physical = scale · θ_L,j − offset.
struct PhysicalScale {
  double scale = 1.0;
  double offset = 0.0;  ///< back-EMF, for viscous terms under voltage
};

/// How each θ_L,j becomes the physical quantity of its name; nothing where the effort is not torque and the robot file
/// lacks the motor's constants. Current: torque = k_t·gear·i at the wheel. Voltage: i = (V − k_e·gear·ω)/R, so that the
/// back-EMF k_t k_e gear²/R stands in the viscous terms.
[[nodiscard]] std::optional<std::vector<PhysicalScale>> physical_scales(const Robot& robot, const Model& model);

/// Unit of θ_L,j with the effort that was used in place of N·m (or N).
[[nodiscard]] std::string parameter_unit(const Robot& robot, const Parameter& parameter);

/// Unit of an output with the effort that was used in place of N·m (or N).
[[nodiscard]] std::string output_unit(const Robot& robot, const std::string& unit);

}  // namespace wheelwright

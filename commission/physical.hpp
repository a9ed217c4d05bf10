// SPDX-License-Identifier: Apache-2.0
/// \file
/// Physical quantities (mass, inertia, friction) of θ_L, and the choice of the dry-friction parameters.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "commission/validation.hpp"
#include "core/interval.hpp"
#include "core/regression.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {

/// Root mean square errors on held-out blocks, relative to the torque, of the first `basic` parameters alone and of
/// all.
struct ParameterChoice {
  double nrmse_basic = 0.0;
  double nrmse_full = 0.0;
  bool full = false;  ///< all parameters are worth having: the held-out error falls by more than a tenth
};

/// Fits both on the training blocks of `rows` and compares them on the held-out ones; two walks.
[[nodiscard]] ParameterChoice choose_parameters(core::RegressionSource& rows, std::size_t basic, std::size_t log_rows,
                                                const FoldOptions& folds);

/// physical = scale · θ_L,j − offset.
struct PhysicalScale {
  double scale = 1.0;
  double offset = 0.0;  ///< back-EMF, for viscous terms under voltage
};

/// Scales from each θ_L,j to the physical quantity of its name; nothing where the effort is not torque and the robot
/// file lacks the motor's constants. Current: torque = k_t·gear·i at the wheel. Voltage: i = (V − k_e·gear·ω)/R, so
/// that the back-EMF k_t k_e gear²/R stands in the viscous terms.
[[nodiscard]] std::optional<std::vector<PhysicalScale>> physical_scales(const Robot& robot, const Model& model);

/// Unit of θ_L,j with the effort that was used in place of N·m (or N).
[[nodiscard]] std::string parameter_unit(const Robot& robot, const model::Parameter& parameter);

/// Unit of an output with the effort that was used in place of N·m (or N).
[[nodiscard]] std::string output_unit(const Robot& robot, const std::string& unit);

}  // namespace wheelwright::commission

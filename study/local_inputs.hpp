// SPDX-License-Identifier: Apache-2.0
/// \file
/// Inputs of a robot file near the value that they have: the robot and the filter beside it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <wheelwright/filter/design.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// A commissioned robot and its filter: what an input changes.
struct RobotAt {
  Robot robot;
  FilterDesign filter;
};

/// One side of a prior, as an input moves it.
struct PriorRate {
  std::string parameter;                       ///< physical name
  double lower_left = 0.0, lower_right = 0.0;  ///< rates of the lower side, physical unit per unit of the input
  double upper_left = 0.0, upper_right = 0.0;  ///< of the upper side
};

/// An input by its name.
struct LocalInput {
  std::string name;
  std::string unit;
  double value = 0.0;
  std::optional<PriorRate> prior{};  ///< where it is a prior's: it moves sides only, and no row
};

/// The input `name` of `at`, whose model is `model`. Throws InvalidArgument where there is none, or it has no value.
[[nodiscard]] LocalInput local_input(const RobotAt& at, const Model& model, const std::string& name);

/// `at` with the input (not a prior's) at `x`. α follows β where the robot file gives none.
[[nodiscard]] RobotAt with_input(RobotAt at, const LocalInput& input, double x);

/// All inputs that `at` has a value for, priors left out.
[[nodiscard]] std::vector<std::string> robot_inputs(const RobotAt& at);

}  // namespace wheelwright

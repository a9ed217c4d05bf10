// SPDX-License-Identifier: Apache-2.0
/// \file
/// The catalogue's formulas, for the oracle.
#pragma once

#include <functional>
#include <string_view>
#include <vector>

#include "tests/world/signals.hpp"

namespace wheelwright::reality {

/// An effect at one value of its shape parameter.
struct Guess {
  std::vector<Column> columns;            ///< with free coefficients
  std::array<Eigen::VectorXd, 2> torque;  ///< what reaches the wheels instead of the command; empty: the command
  double late = 0.0;                      ///< speeds are late by so much against the pose, s
};

/// A formula of the catalogue.
struct Rival {
  std::string_view name;
  std::function<Guess(const RobotDesign&, const Signals&, double)> guess;
  double low = 0.0;  ///< range of the shape parameter; none where low = high
  double high = 0.0;
  bool parametric = false;  ///< a change of the nominal parameters: rivals of each other
};

/// All formulas.
[[nodiscard]] std::vector<Rival> rivals(const RobotDesign& robot);

/// True if `truth` is a special case of `rival`, or the same.
[[nodiscard]] bool nests(std::string_view rival, std::string_view truth);

}  // namespace wheelwright::reality

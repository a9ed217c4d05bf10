// SPDX-License-Identifier: Apache-2.0
/// \file
/// A commissioning in lines and tables for a terminal.
#pragma once

#include <string>

#include "commission/commission.hpp"
#include "model/robot.hpp"

namespace wheelwright::words {

/// The smallest fault ζ = κ·Yθ of which some instant of held-out driving is certain, in the words of the robot's kind;
/// that there is none where κ is more than 1.
[[nodiscard]] std::string smallest_fault(const Robot& robot, double kappa);

/// Summary of a commissioning for a terminal.
[[nodiscard]] std::string summary(const Commissioning& result);

}  // namespace wheelwright::words

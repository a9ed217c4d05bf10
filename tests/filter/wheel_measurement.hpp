// SPDX-License-Identifier: Apache-2.0
/// \file
/// The measurement of two wheels that tests of filters share.
#pragma once

#include <string>
#include <vector>

#include "model/filter/measurement.hpp"

namespace wheelwright::filter {

/// Angles or speeds of both wheels, and their torques.
inline Measurement wheels(MotionKind motion, Hold hold = Hold::first_order) {
  Measurement m;
  m.motion = motion;
  m.motion_columns = motion == MotionKind::angle ? std::vector<std::string>{"phi_r", "phi_l"}
                                                 : std::vector<std::string>{"omega_r", "omega_l"};
  m.effort_columns = {"tau_r", "tau_l"};
  m.hold = hold;
  return m;
}

}  // namespace wheelwright::filter

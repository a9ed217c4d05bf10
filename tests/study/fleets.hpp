// SPDX-License-Identifier: Apache-2.0
/// \file
/// Fleets made of numbers: tables as commissioning would give them, without logs.
#pragma once

#include <string>
#include <vector>

#include "study/population.hpp"
#include "tests/support/random.hpp"

namespace wheelwright::testing_support {

/// A record of one log with the parameters "mass" and "yaw_inertia": the truth, an estimate that is off by a normal
/// error of `error`, and guaranteed bounds that hold the truth, about 4 errors wide on each side.
inline study::RobotRecord drawn_record(const std::string& name, const std::vector<double>& truth, double error,
                                       Random& random) {
  static const std::vector<std::string> names = {"mass", "yaw_inertia", "viscous_linear", "viscous_yaw"};
  study::RobotRecord record{.robot = name, .dated = false, .commissioning = {}};
  record.commissioning.status = study::RobotStatus::commissioned;
  for (std::size_t j = 0; j < truth.size(); ++j) {
    const double below = error * (1.0 + 3.0 * random.unit()), above = error * (1.0 + 3.0 * random.unit());
    record.commissioning.parameters.push_back({.name = names.at(j),
                                               .unit = "kg",
                                               .is_prior_key = true,
                                               .estimate = truth[j] + error * random.normal(),
                                               .standard_error = error,
                                               .lower = truth[j] - below,
                                               .upper = truth[j] + above,
                                               .prior = {-1e4, 1e4}});
  }
  return record;
}

}  // namespace wheelwright::testing_support

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Uses the installed package: a model is made, and a mistake is refused by the library's own exception.

#include <cstdlib>
#include <string>

#include <wheelwright/core/error.hpp>
#include <wheelwright/core/log.hpp>
#include <wheelwright/model/differential_drive.hpp>

int main() {
  const wheelwright::DifferentialDrive robot{.wheel_radius = 0.1, .track_width = 0.4};
  const wheelwright::Model model = robot.model();
  if (model.p() != 4 || model.n() != 2) {
    return EXIT_FAILURE;
  }

  wheelwright::LogTable table;
  table.names = {"omega_r"};
  table.columns = {{1.0, 2.0}};
  table.t = {0.0, 0.5};
  if (wheelwright::core::median_step(table.t) != 0.5) {
    return EXIT_FAILURE;
  }
  try {
    (void)table.column("omega_l");
  } catch (const wheelwright::InvalidArgument&) {
    return EXIT_SUCCESS;
  }
  return EXIT_FAILURE;
}

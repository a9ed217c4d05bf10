// SPDX-License-Identifier: Apache-2.0
/// \file
/// The numbers of a fleet by parameter: all that is kept of its records while they stream by.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/study/robot_record.hpp>

namespace wheelwright {

/// One robot's value of a parameter.
struct FleetEntry {
  std::size_t robot = 0;        ///< index into FleetTable::robots
  double estimate = 0.0;        ///< NaN where the log does not show it
  double standard_error = 0.0;  ///< NaN where there is none
  double freedom = 0.0;         ///< of the standard error; infinite where it is taken as exact
  double lower = 0.0;           ///< bounds
  double upper = 0.0;
  Interval prior{};  ///< in which they were sought
};

/// One parameter over the fleet.
struct FleetColumn {
  std::string name;
  std::string unit;
  bool is_prior_key = false;
  std::vector<FleetEntry> entries{};        ///< ascending robots
  Warrant warrant = Warrant::extrapolated;  ///< the weakest of all logs' bounds of it, those of checks included
};

/// Robots in the order in which they were added.
struct FleetTable {
  std::vector<std::string> robots{};
  std::vector<RobotStatus> status{};
  std::vector<FleetColumn> columns{};
};

/// Index of the column `name` with `unit`; a new one where there is none.
[[nodiscard]] std::size_t column_of(FleetTable& table, const RecordedParameter& parameter);

/// Appends the robot of `record` with the parameters of its commissioning.
void add(FleetTable& table, const RobotRecord& record);

}  // namespace wheelwright

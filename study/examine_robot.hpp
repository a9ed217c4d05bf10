// SPDX-License-Identifier: Apache-2.0
/// \file
/// One robot of a fleet, examined: the item of work of `wheelwright fleet`.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "commission/commission.hpp"
#include "core/log.hpp"
#include "study/population.hpp"

namespace wheelwright::study {

/// A log at hand, with its robot (whose noise bounds hold what reading the log added).
struct OpenedLog {
  std::unique_ptr<LogSource> log;
  Robot robot;
  std::size_t met = 0;  ///< rows that were met, those included that could not be used; 0 where all could
};

/// A log of a robot that is opened when its turn comes. `open` throws where it cannot be.
struct FleetLog {
  std::string name;
  double when = 0.0;  ///< days, or the order
  std::function<OpenedLog()> open;
};

/// Logs of one robot.
struct RobotLogs {
  std::string robot;
  bool dated = false;
  FleetLog commissioning;
  std::vector<FleetLog> checks{};  ///< in order of time
  std::vector<std::string> findings{};
};

/// Options of examine_robot().
struct ExamineOptions {
  commission::CommissionOptions commission{};
  detector::DetectorOptions detector{};
};

/// Commissions the robot, walks its detector over every check, and commissions each check by itself. Whatever a log or
/// a robot throws (any std::exception) becomes the status and message of that log: nothing is thrown. The same logs
/// give the same record.
[[nodiscard]] RobotRecord examine_robot(const RobotLogs& logs, const ExamineOptions& options = {});

/// The record's parameters of a commissioning; none where it gave no bounds.
[[nodiscard]] std::vector<RecordedParameter> recorded_parameters(const Commissioning& result);

}  // namespace wheelwright::study

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Logs of one robot of a fleet, which are opened when their turn comes.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "model/robot.hpp"

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

}  // namespace wheelwright::study

// SPDX-License-Identifier: Apache-2.0
// What commands make of a log that `doctor` has examined.
#pragma once

#include "commission/commission.hpp"
#include "commission/doctor/log_health.hpp"

namespace wheelwright::testing_support {

/// `log` as every command reads it (results/sound_log.hpp), commissioned: with the speed filter, delay and smoothing of
/// efforts that `health` found in it, beside what `read` says.
inline commission::Commissioning commissioned_as_found(const LogTable& log, Robot read,
                                                       const doctor::LogHealth& health) {
  for (const doctor::LogFinding& found : health.findings) {
    read.speed_filter = found.speed_filter ? found.speed_filter : read.speed_filter;
    if (found.id == "time.effort_delay" && found.taken) {
      read.effort_delay = *found.taken;
      read.effort_time_origin = model::EffortTimeOrigin::found;
    }
    if (found.effort_smoothing) {
      read.effort_smoothing = *found.effort_smoothing;
      read.effort_time_origin = model::EffortTimeOrigin::found;
    }
  }
  TableSource source(log);
  commission::CommissionOptions options;
  options.at_risk = commission::CommissionOptions::AtRisk::nothing;
  return commission::commission_robot(source, read, options);
}

}  // namespace wheelwright::testing_support

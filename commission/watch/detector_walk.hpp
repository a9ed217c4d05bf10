// SPDX-License-Identifier: Apache-2.0
/// \file
/// Detection over a whole log: the walk of a commissioned detector from row to row.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "commission/detection.hpp"
#include "commission/event_isolation.hpp"
#include "core/log.hpp"
#include "detector/detector.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::commission {

/// Walks `log` from its beginning through `detector` (of either residual), which restarts with every segment, and calls
/// `at(row, t, first, decision)` for every instant at which it decides: the row of the log, its time in s, whether it
/// is the first such instant of its segment, and the Decision, valid during the call. Returns the number of rows and
/// rewinds the log. Throws InvalidArgument when the log lacks a column.
template <filter::RowFilter Filter, typename At>
std::size_t walk_detector(LogSource& log, Detector<Filter>& detector, const At& at) {
  std::size_t rows = 0;
  bool first = true;
  const auto visit = [&](const core::LogSample& sample) {
    ++rows;
    if (sample.starts) {
      detector.restart();
      first = true;
    }
    const Decision& decision = detector.step(sample.t, sample.values);
    if (decision.valid) {
      at(sample.row, sample.t, first, decision);
      first = false;
    }
  };
  core::for_each_sample(log, detector.filter().measurement().columns(), visit, ", which the model was commissioned on");
  return rows;
}

/// Walks `log` through `detector` from its beginning. Of the kinematic residual OutputTrace::torque and predicted are
/// what the pose or gyro saw and what the wheels predict. Throws InvalidArgument when the log lacks a column.
template <filter::RowFilter Filter>
[[nodiscard]] Detection detect(LogSource& log, Detector<Filter> detector, const DetectionOptions& options = {});

extern template Detection detect(LogSource& log, TorqueDetector detector, const DetectionOptions& options);
extern template Detection detect(LogSource& log, detector::KinematicDetector detector, const DetectionOptions& options);

/// The kinematic residual of `log`, where it and the model have one.
[[nodiscard]] KinematicWatch watch_kinematics(LogSource& log, const OnlineModel& model,
                                              const detector::DetectorOptions& options,
                                              const DetectionOptions& detection = {});

}  // namespace wheelwright::commission

namespace wheelwright {
using commission::detect;
}  // namespace wheelwright

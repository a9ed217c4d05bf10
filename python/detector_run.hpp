// SPDX-License-Identifier: Apache-2.0
/// \file
/// Every decision of a detector over a whole log, in arrays.
#pragma once

#include <cstdint>
#include <vector>

#include <wheelwright/core/log.hpp>
#include <wheelwright/core/regression.hpp>
#include <wheelwright/detector/detector.hpp>

namespace wheelwright::python {

/// K instants with a decision, n outputs each. Matrices are K × n in memory, rows one after the other.
struct DetectorRun {
  std::vector<double> t;          ///< s
  std::vector<std::int64_t> row;  ///< of the log
  std::vector<double> residual, predicted, lower, upper;
  std::vector<std::uint8_t> outside, alarm;
  std::vector<detector::Event> events;
  std::size_t outputs = 0;
};

/// Walks `log` through `detector` from its beginning, as detect() does. Throws InvalidArgument when the log lacks a
/// column.
[[nodiscard]] DetectorRun run_detector(LogSource& log, TorqueDetector& detector, double merge);

}  // namespace wheelwright::python

// SPDX-License-Identifier: Apache-2.0
/// \file
/// A log through a detector, instant by instant.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/log.hpp>
#include <wheelwright/detector/row_detector.hpp>

namespace wheelwright {

/// Walks `log` from its beginning through `detector` (of either residual), which restarts with every segment, and calls
/// `at(row, t, first, decision)` for every instant at which it decides: the row of the log, its time in s, whether it is
/// the first such instant of its segment, and the Decision, valid during the call. Returns the number of rows and rewinds
/// the log. Throws InvalidArgument when the log lacks a column.
template <typename AnyDetector, typename At>
std::size_t walk_detector(LogSource& log, AnyDetector& detector, const At& at) {
  std::vector<std::size_t> pick;
  for (const std::string& name : detector.filter().measurement().columns()) {
    const auto column = log.find(name);
    check::that(column.has_value(), "log", "a column '" + name + "', which the model was commissioned on");
    pick.push_back(*column);
  }
  std::vector<double> sample(pick.size());
  std::size_t rows = 0;
  bool first = true;
  log.rewind();
  LogBlock block;
  while (log.next(block)) {
    rows += block.rows();
    std::size_t segment = 0;
    for (std::size_t k = 0; k < block.rows(); ++k) {
      if (segment < block.segment_starts.size() && block.segment_starts[segment] == k) {
        ++segment;
        detector.restart();
        first = true;
      }
      for (std::size_t c = 0; c < pick.size(); ++c) {
        sample[c] = block.columns[pick[c]][k];
      }
      const Decision& decision = detector.step(block.t[k], sample);
      if (decision.valid) {
        at(block.first_row + k, block.t[k], first, decision);
        first = false;
      }
    }
  }
  log.rewind();
  return rows;
}

}  // namespace wheelwright

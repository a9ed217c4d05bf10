// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/filter/regression_stream.hpp>

#include <utility>

#include <wheelwright/core/check.hpp>

namespace wheelwright {

RegressionStream::RegressionStream(LogSource& log, RegressorFilter filter) : log_(&log), filter_(std::move(filter)) {
  for (const auto& name : filter_.measurement().columns()) {
    const auto column = log.find(name);
    check::that(column.has_value(), "log", "a column '" + name + "'");
    pick_.push_back(*column);
  }
  sample_.resize(pick_.size());
  rewind();
}

void RegressionStream::rewind() {
  log_->rewind();
  filter_.restart();
}

bool RegressionStream::next(RegressionBlock& block) {
  if (!log_->next(scratch_)) {
    block.resize(0, outputs(), parameters());
    return false;
  }
  const auto n = static_cast<Eigen::Index>(outputs());
  block.resize(scratch_.rows(), outputs(), parameters());
  std::size_t kept = 0;
  std::size_t segment = 0;
  for (std::size_t k = 0; k < scratch_.rows(); ++k) {
    if (segment < scratch_.segment_starts.size() && scratch_.segment_starts[segment] == k) {
      filter_.restart();
      ++segment;
    }
    for (std::size_t c = 0; c < pick_.size(); ++c) {
      sample_[c] = scratch_.columns[pick_[c]][k];
    }
    if (!filter_.step(scratch_.t[k], sample_)) {
      continue;
    }
    const FilteredRow& row = filter_.row();
    const auto at = static_cast<Eigen::Index>(kept) * n;
    block.sample[kept] = scratch_.first_row + k;
    block.t[kept] = scratch_.t[k];
    block.Y.middleRows(at, n) = row.Y;
    block.dY.middleRows(at, n) = row.dY;
    block.y.segment(at, n) = row.y;
    block.dy.segment(at, n) = row.dy;
    ++kept;
  }
  block.sample.resize(kept);
  block.t.resize(kept);
  const auto rows = block.rows();
  block.Y.conservativeResize(rows, Eigen::NoChange);
  block.dY.conservativeResize(rows, Eigen::NoChange);
  block.y.conservativeResize(rows);
  block.dy.conservativeResize(rows);
  return true;
}

}  // namespace wheelwright

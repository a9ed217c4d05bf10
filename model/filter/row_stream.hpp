// SPDX-License-Identifier: Apache-2.0
/// \file
/// Row filters, and the stream of regression rows of a log, block by block in bounded memory.
#pragma once

#include <concepts>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/check.hpp"
#include "core/log.hpp"
#include "core/regression.hpp"
#include "model/filter/odometry_filter.hpp"
#include "model/filter/regressor_filter.hpp"

namespace wheelwright::filter {

/// Concept of a residual's filter: samples of measurement().columns() in, rows of outputs() × parameters() out. step()
/// returns whether row() holds an instant, restart() begins a segment. RegressorFilter and OdometryFilter are two; what
/// consumes rows (RowStream, Detector) takes any.
template <typename F>
concept RowFilter = requires(F filter, const F& constant, double t, std::span<const double> sample) {
  { filter.step(t, sample) } -> std::same_as<bool>;
  filter.restart();
  { constant.row() } -> std::same_as<const FilteredRow&>;
  { constant.outputs() } -> std::same_as<std::size_t>;
  { constant.parameters() } -> std::same_as<std::size_t>;
  { constant.measurement().columns() } -> std::convertible_to<std::vector<std::string>>;
  { constant.measurement().nominal_step } -> std::convertible_to<double>;
};

/// Walks a log through a filter, which restarts at every segment of the log, so nothing is filtered across a gap. The
/// log must outlive the stream and is rewound by it.
template <RowFilter Filter>
class RowStream final : public core::RegressionSource {
 public:
  /// Throws InvalidArgument when `log` lacks a column of the filter's measurement.
  RowStream(LogSource& log, Filter filter);
  [[nodiscard]] std::size_t outputs() const override { return filter_.outputs(); }
  [[nodiscard]] std::size_t parameters() const override { return filter_.parameters(); }
  bool next(RegressionBlock& block) override;
  void rewind() override;
  [[nodiscard]] const Filter& filter() const { return filter_; }

 private:
  LogSource* log_;
  Filter filter_;
  std::vector<std::size_t> pick_;
  std::vector<double> sample_;
  LogBlock scratch_;
};

/// Rows of the torque residual.
using TorqueRows = RowStream<RegressorFilter>;
/// Rows of the kinematic residual.
using OdometryRows = RowStream<OdometryFilter>;

template <RowFilter Filter>
RowStream<Filter>::RowStream(LogSource& log, Filter filter)
    : log_(&log), filter_(std::move(filter)), pick_(core::positions_of(log, filter_.measurement().columns())) {
  sample_.resize(pick_.size());
  rewind();
}

template <RowFilter Filter>
void RowStream<Filter>::rewind() {
  log_->rewind();
  filter_.restart();
}

template <RowFilter Filter>
bool RowStream<Filter>::next(RegressionBlock& block) {
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

extern template class RowStream<RegressorFilter>;
extern template class RowStream<OdometryFilter>;

}  // namespace wheelwright::filter

namespace wheelwright {
using filter::TorqueRows;
}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// A log as a linear regression, block by block, without ever holding the whole of either.
#pragma once

#include <cstddef>
#include <vector>

#include <wheelwright/core/log.hpp>
#include <wheelwright/core/regression.hpp>
#include <wheelwright/filter/regressor_filter.hpp>

namespace wheelwright {

/// Walks a log through a RegressorFilter; the filter restarts at every segment of the log, so nothing is filtered across
/// a gap. The log must outlive the stream and is rewound by it.
class RegressionStream final : public RegressionSource {
 public:
  /// Throws InvalidArgument when `log` lacks a column of the filter's measurement.
  RegressionStream(LogSource& log, RegressorFilter filter);
  [[nodiscard]] std::size_t outputs() const override { return filter_.model().n(); }
  [[nodiscard]] std::size_t parameters() const override { return filter_.model().p(); }
  bool next(RegressionBlock& block) override;
  void rewind() override;
  [[nodiscard]] const RegressorFilter& filter() const { return filter_; }

 private:
  LogSource* log_;
  RegressorFilter filter_;
  std::vector<std::size_t> pick_;
  std::vector<double> sample_;
  LogBlock scratch_;
};

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The detector of Dixon, Walker and Dawson (2001), section V, with the tight threshold: sample in, decision out.
#pragma once

#include <span>

#include <wheelwright/detector/row_detector.hpp>
#include <wheelwright/filter/regressor_filter.hpp>

namespace wheelwright {

/// Everything in one object that a robot carries: filter, threshold, decision. Not for several threads at once.
class Detector {
 public:
  /// `filter` brings the error bounds dY and dy of its rows; ē of an estimated noise level belongs in dy. `threshold`
  /// must have the filter's number of parameters. Throws InvalidArgument otherwise, and on persistence or μ_o that make
  /// no sense.
  Detector(RegressorFilter filter, ThresholdRule threshold, DetectorOptions options = {});

  /// Forgets all samples: for a gap in the data.
  void restart();

  /// Takes the sample at time `t` (s; as RegressorFilter::step) and decides. Allocates nothing. A gap of more than five
  /// nominal steps, or a time that does not increase, restarts the filter. The result is valid until the next call.
  const Decision& step(double t, std::span<const double> sample);

  /// Decides on a row that was filtered elsewhere (Y: n × p, dY: n × p, y and dy: n values). Allocates nothing.
  const Decision& decide(const FilteredRow& row) { return rows_.decide(row); }

  [[nodiscard]] const RegressorFilter& filter() const { return filter_; }
  [[nodiscard]] const ThresholdRule& threshold() const { return rows_.threshold(); }
  [[nodiscard]] const DetectorOptions& options() const { return rows_.options(); }

 private:
  RegressorFilter filter_;
  RowDetector rows_;
  bool started_ = false;
  double t_ = 0.0;
};

}  // namespace wheelwright

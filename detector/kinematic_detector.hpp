// SPDX-License-Identifier: Apache-2.0
/// \file
/// The detector of the kinematic residual: what the torque residual cannot see, such as lateral slip.
#pragma once

#include <span>

#include <wheelwright/detector/row_detector.hpp>
#include <wheelwright/filter/odometry_filter.hpp>

namespace wheelwright {

/// Odometry window, threshold, decision in one object, beside Detector. Not for several threads at once.
class KinematicDetector {
 public:
  /// `filter` brings the error bounds of its rows. `threshold` must have the filter's number of parameters. Throws
  /// InvalidArgument otherwise, and on persistence or μ_o that make no sense.
  KinematicDetector(OdometryFilter filter, ThresholdRule threshold, DetectorOptions options = {});

  /// Forgets all samples: for a gap in the data.
  void restart();

  /// Takes the sample at time `t` (s; as OdometryFilter::step) and decides. Allocates nothing. A gap of more than five
  /// nominal steps, or a time that does not increase, restarts the window. The result is valid until the next call; it
  /// is not valid (Decision::valid) where the filter has no row.
  const Decision& step(double t, std::span<const double> sample);

  /// Decides on a row that was filtered elsewhere. Allocates nothing.
  const Decision& decide(const FilteredRow& row) { return rows_.decide(row); }

  [[nodiscard]] const OdometryFilter& filter() const { return filter_; }
  [[nodiscard]] const ThresholdRule& threshold() const { return rows_.threshold(); }
  [[nodiscard]] const DetectorOptions& options() const { return rows_.options(); }

 private:
  OdometryFilter filter_;
  RowDetector rows_;
  bool started_ = false;
  double t_ = 0.0;
};

}  // namespace wheelwright

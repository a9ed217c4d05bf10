// SPDX-License-Identifier: Apache-2.0
/// \file
/// The dead-zone detector of Dixon, Walker and Dawson (2001), section V, with the tight threshold, for either residual.
#pragma once

#include <cmath>
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/check.hpp"
#include "detector/detector_options.hpp"
#include "detector/threshold.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::detector {

/// D1[ε] of (35) with the time-varying threshold ρ >= 0, and D2[ε] of (39) with a constant μ_o in its place:
/// |ε| where |ε| > threshold, else 0. The size tells how far the threshold was exceeded (Remark 6).
inline double dead_zone(double residual, double threshold) noexcept {
  const double size = std::abs(residual);
  return size > threshold ? size : 0.0;
}

/// The two-sided form: |ε| where ε lies outside [lower, upper], else 0.
inline double dead_zone(double residual, double lower, double upper) noexcept {
  return residual < lower || residual > upper ? std::abs(residual) : 0.0;
}

/// One output at one instant.
struct ChannelDecision {
  double residual = 0.0;   ///< ε = τ_f − Y_f θ̂ (29)
  double predicted = 0.0;  ///< Y_f θ̂ (30)
  Threshold threshold;     ///< [l, u] and ρ
  double dead_zone = 0.0;  ///< D1 (35) or D2 (39): |ε| outside the threshold, else 0
  bool outside = false;    ///< dead_zone > 0
  bool alarm = false;      ///< persistence satisfied
};

/// The decision at one instant.
struct Decision {
  bool valid = false;                     ///< false until the filter has settled: nothing is known yet
  bool fault = false;                     ///< an alarm stands in some channel
  std::vector<ChannelDecision> channels;  ///< one for each output, meaningful where valid
};

/// Residual, threshold and decision for rows of n outputs, wherever they were filtered. Not for several threads at
/// once.
class RowDetector {
 public:
  /// Throws InvalidArgument on persistence or μ_o that make no sense.
  RowDetector(std::size_t outputs, ThresholdRule threshold, DetectorOptions options = {});

  /// Forgets what persistence remembers.
  void restart();

  /// Decides on a row (Y: n × p, dY: n × p, y and dy: n values). Allocates nothing. The result is valid until the next
  /// call of any member.
  const Decision& decide(const filter::FilteredRow& row);

  /// The decision at an instant without a row: not valid, no fault.
  const Decision& nothing();

  [[nodiscard]] const ThresholdRule& threshold() const { return threshold_; }
  [[nodiscard]] const DetectorOptions& options() const { return options_; }

 private:
  ThresholdRule threshold_;
  DetectorOptions options_;
  std::vector<PersistenceCounter> counters_;
  Decision decision_;
};

/// True if a sample at time `t` (s) follows the one at `before` in the same segment: later, by no more than five steps
/// of `nominal` (s; 0: any), as logs are split.
[[nodiscard]] bool follows(double before, double t, double nominal) noexcept;

/// True if `t` and all values of `sample` are finite numbers. A sample that is not whole is taken for lost: filters and
/// sums would never be rid of it.
[[nodiscard]] bool is_whole(double t, std::span<const double> sample) noexcept;

/// The detector of Dixon, Walker and Dawson (2001), section V, with the tight threshold: filter, threshold and decision
/// in one object that a robot carries, for one residual. Sample in, decision out. Not for several threads at once.
template <filter::RowFilter Filter>
class Detector {
 public:
  /// `filter` brings the error bounds dY and dy of its rows; ē of an estimated noise level belongs in dy. `threshold`
  /// must have the filter's number of parameters. Throws InvalidArgument otherwise, and on persistence or μ_o that make
  /// no sense.
  Detector(Filter filter, ThresholdRule threshold, DetectorOptions options = {})
      : filter_(std::move(filter)), rows_(filter_.outputs(), std::move(threshold), std::move(options)) {
    check::that(rows_.threshold().set().dimension() == filter_.parameters(), "feasible set",
                "as many parameters as the filter's rows have");
  }

  /// Forgets all samples: for a gap in the data.
  void restart() {
    started_ = false;
    filter_.restart();
    rows_.restart();
  }

  /// Takes the sample at time `t` (s; as the filter's step) and decides. Allocates nothing. A gap of more than five
  /// nominal steps, or a time that does not increase, restarts the filter. The result is valid until the next call; it
  /// is not valid (Decision::valid) where the filter has no row, nor for a sample that is not whole (is_whole()), which
  /// is as good as lost.
  const Decision& step(double t, std::span<const double> sample) {
    if (!is_whole(t, sample)) {
      return rows_.nothing();
    }
    if (started_ && !follows(t_, t, filter_.measurement().nominal_step)) {
      restart();
    }
    started_ = true;
    t_ = t;
    return filter_.step(t, sample) ? rows_.decide(filter_.row()) : rows_.nothing();
  }

  /// Decides on a row that was filtered elsewhere (Y: n × p, dY: n × p, y and dy: n values). Allocates nothing.
  const Decision& decide(const filter::FilteredRow& row) { return rows_.decide(row); }

  [[nodiscard]] const Filter& filter() const { return filter_; }
  [[nodiscard]] const ThresholdRule& threshold() const { return rows_.threshold(); }
  [[nodiscard]] const DetectorOptions& options() const { return rows_.options(); }

 private:
  Filter filter_;
  RowDetector rows_;
  bool started_ = false;
  double t_ = 0.0;
};

/// Of the torque residual.
using TorqueDetector = Detector<RegressorFilter>;
/// Of the kinematic residual: what the torque residual cannot see, such as lateral slip.
using KinematicDetector = Detector<filter::OdometryFilter>;

extern template class Detector<RegressorFilter>;
extern template class Detector<filter::OdometryFilter>;

}  // namespace wheelwright::detector

namespace wheelwright {
using detector::Decision;
using detector::Detector;
using detector::TorqueDetector;
}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The detector of Dixon, Walker and Dawson (2001), section V, with the tight threshold: sample in, decision out.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/detector/dead_zone.hpp>
#include <wheelwright/detector/events.hpp>
#include <wheelwright/detector/threshold.hpp>
#include <wheelwright/filter/regressor_filter.hpp>

namespace wheelwright {

/// Which comparison decides.
enum class Test {
  two_sided,  ///< l <= ε <= u: does not depend on θ̂ and is never less sensitive
  symmetric,  ///< |ε| <= ρ: the paper's (35)
};

/// How a detector decides.
struct DetectorOptions {
  ParameterSetKind set = ParameterSetKind::polytope;
  Test test = Test::two_sided;
  /// k of n; 1 of 1 (or what a commissioned model says) where it is not given, which keeps the certain detections of
  /// theory section 5.
  std::optional<Persistence> persistence{};
  std::optional<Eigen::VectorXd> mu{};  ///< μ_o of (39), one for each output: constant thresholds instead of ρ(t)
};

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
  const Decision& decide(const FilteredRow& row);

  [[nodiscard]] const RegressorFilter& filter() const { return filter_; }
  [[nodiscard]] const ThresholdRule& threshold() const { return threshold_; }
  [[nodiscard]] const DetectorOptions& options() const { return options_; }

 private:
  RegressorFilter filter_;
  ThresholdRule threshold_;
  DetectorOptions options_;
  std::vector<PersistenceCounter> counters_;
  Decision decision_;
  bool started_ = false;
  double t_ = 0.0;
};

}  // namespace wheelwright

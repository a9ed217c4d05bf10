// SPDX-License-Identifier: Apache-2.0
/// \file
/// The decision of Dixon, Walker and Dawson (2001), section V, on one row of a regression, with the tight threshold.
#pragma once

#include <cstddef>
#include <optional>
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

/// Residual, threshold and decision for rows of n outputs, wherever they were filtered. Not for several threads at once.
class RowDetector {
 public:
  /// Throws InvalidArgument on persistence or μ_o that make no sense.
  RowDetector(std::size_t outputs, ThresholdRule threshold, DetectorOptions options = {});

  /// Forgets what persistence remembers.
  void restart();

  /// Decides on a row (Y: n × p, dY: n × p, y and dy: n values). Allocates nothing. The result is valid until the next
  /// call of any member.
  const Decision& decide(const FilteredRow& row);

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

/// Whether a sample at time `t` (s) follows the one at `before` in the same segment: later, by no more than five steps
/// of `nominal` (s; 0: any), as logs are split.
[[nodiscard]] bool follows(double before, double t, double nominal) noexcept;

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Times of a log as people read them.
#pragma once

#include <string>
#include <vector>

namespace wheelwright::words {

/// Times of a page. They count from an origin where the log's clock is an epoch, so that digits are left for the
/// driving. Where the log's time goes back (several runs in one log), its runs are laid end to end: a moment then no
/// longer has one place on the axis.
class TimeAxis {
 public:
  /// The axis for the times `t` (s) of a whole log, or of what is known of it: origin 0 unless the first one is beyond
  /// ±10⁶ s.
  explicit TimeAxis(const std::vector<double>& t = {});

  /// s, subtracted from every time that is shown.
  [[nodiscard]] double origin() const { return origin_; }
  /// True if the log's time goes back somewhere.
  [[nodiscard]] bool repeats() const { return offsets_.size() > 1; }
  /// Seconds since the origin.
  [[nodiscard]] double shown(double t) const { return t - origin_; }
  /// "12.345 s".
  [[nodiscard]] std::string text(double t) const;
  /// Places on the axis of the times `t` of one walk over the log; never decreasing.
  [[nodiscard]] std::vector<double> lay(const std::vector<double>& t) const;

 private:
  double origin_ = 0.0;
  std::vector<double> offsets_;  // of each run, s
};

}  // namespace wheelwright::words

// SPDX-License-Identifier: Apache-2.0
/// \file
/// A whole log under the detector at a stated risk.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "detector/learnt_model.hpp"
#include "detector/sum_weight.hpp"

namespace wheelwright::detector {
class PoseSumDetector;
class ScaleDetector;
struct SumState;
}  // namespace wheelwright::detector

namespace wheelwright::commission {

/// Sums outside what a healthy robot's can be, without a longer pause.
struct RiskEvent {
  double alarm = 0.0;                          ///< s, when the first one was seen
  double end = 0.0;                            ///< s, when the last one was
  detector::SumWeight weight{};                ///< of the first one, where it is of the torque residual
  double scale = 0.0;                          ///< s, of the first one: over about this time it has come together
  double ratio = 0.0;                          ///< largest |value|/threshold of all
  double peak_time = 0.0;                      ///< s
  std::optional<detector::PoseWeight> pose{};  ///< of the first one, where it is of the kinematic residual
};

/// Result of watch_at_risk().
struct RiskWatch {
  bool watched = false;       ///< false: the model says nothing at a stated risk
  bool pose = false;          ///< whether sums of the kinematic residual were watched
  double false_alarms = 0.0;  ///< at most as many are to be expected in a second
  std::size_t looks = 0;      ///< at sums
  double utilisation = 0.0;   ///< largest |value|/threshold
  std::vector<RiskEvent> events;
};

/// Makes events of what a ScaleDetector and a PoseSumDetector see.
class RiskRecorder {
 public:
  /// Events are apart by more than `merge` s, and than a quarter of the scale that shows them.
  explicit RiskRecorder(double merge = 0.5) : merge_(merge), pause_(merge) {}
  /// Takes the looks of the detector's last step, at the time `t` (s). Returns whether a new event begins.
  bool add(const detector::ScaleDetector& detector, double t);
  bool add(const detector::PoseSumDetector& detector, double t);
  [[nodiscard]] RiskWatch& watch() { return watch_; }

 private:
  // The event that `state` begins at `t`; null where it begins none.
  RiskEvent* take(const detector::SumState& state, double scale, double t);

  RiskWatch watch_;
  double merge_, pause_;
};

/// Rates of false alarms of the sums of both residuals: the stated one, shared (torque_share).
[[nodiscard]] double torque_false_alarms(const OnlineModel& model);
[[nodiscard]] double pose_false_alarms(const OnlineModel& model);

/// Whether `model` says something of the pose at a stated risk, and `log` has its columns.
[[nodiscard]] bool watches_pose(const LogSource& log, const OnlineModel& model);

/// Walks `log` through the ScaleDetector of `model`, and through its PoseSumDetector where it has one and `log` has
/// the pose's columns. The result does not depend on `threads`.
[[nodiscard]] RiskWatch watch_at_risk(LogSource& log, const OnlineModel& model, std::size_t threads = 1,
                                      double merge = 0.5);

/// "bias or jump (tau_r)", "share of the effort (tau_r)", "mass": what the sum of an event looks for.
[[nodiscard]] std::string sum_words(const detector::SumWeight& weight, const Model& model);
/// "slip across the heading", "way of the right wheel".
[[nodiscard]] std::string sum_words(const detector::PoseWeight& weight);
/// Either.
[[nodiscard]] std::string sum_words(const RiskEvent& event, const Model& model);

/// "since 60.2 s: share of the effort (tau_r), seen over 3 s, up to 1.8 times what a healthy robot's errors can do".
[[nodiscard]] std::string sentence(const RiskEvent& event, const Model& model);

}  // namespace wheelwright::commission

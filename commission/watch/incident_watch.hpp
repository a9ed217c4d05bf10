// SPDX-License-Identifier: Apache-2.0
/// \file
/// Incidents of a log, and of rows as they come.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <vector>

#include "commission/detection.hpp"
#include "commission/event_isolation.hpp"
#include "core/log.hpp"
#include "detector/events.hpp"
#include "detector/incidents.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::commission {

/// Joins the events of both residuals of `log` to incidents, in the order of their alarms. `isolations` are those of
/// the first events (isolate_events()); further ones are isolated here as IncidentRecorder::asks() for them, one walk
/// of the log each. Events of the kinematic residual are not isolated.
[[nodiscard]] std::vector<detector::Incident> join_events(LogSource& log, const OnlineModel& model,
                                                          const Detection& detection,
                                                          const std::vector<detector::Isolation>& isolations,
                                                          const KinematicWatch& kinematic,
                                                          const EventIsolationOptions& options = {});

/// The same on rows as they come. Holds the rows that an isolation looks at, some seconds of them, and one incident.
/// An event of the torque residual is isolated IsolationOptions::after seconds past its alarm, without sums at a stated
/// risk: these need the whole log.
class IncidentWatch {
 public:
  /// What an event did that opened an incident or narrowed it, and that incident.
  struct Told {
    detector::IncidentRecorder::Change change;
    detector::Incident incident;
    std::optional<detector::Incident> closed;  ///< the one before
  };

  /// For rows with the columns of `model`'s torque residual.
  explicit IncidentWatch(const OnlineModel& model);
  /// The next row, before what it alarms; `restarts` where a segment begins with it.
  void row(double t, const std::vector<double>& sample, bool restarts);
  /// An event that the last row raised, of the torque residual or of another one.
  void event(const detector::Event& event, bool torque);
  /// What has been settled up to the last row; with `all` all there is.
  [[nodiscard]] std::vector<Told> settle(bool all = false);
  /// An alarm stands at time `t`: the open incident lasts.
  void lasts(double t) { recorder_.lasts(t); }
  /// The incident that is open.
  [[nodiscard]] const std::optional<detector::Incident>& open() const { return recorder_.open(); }

 private:
  struct Waiting {
    detector::Event event;
    bool torque;
  };
  OnlineModel model_;
  EventIsolationOptions options_;
  double keep_;  // s
  LogTable rows_;
  std::deque<Waiting> waiting_;
  detector::IncidentRecorder recorder_;
};

}  // namespace wheelwright::commission

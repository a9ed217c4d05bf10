// SPDX-License-Identifier: Apache-2.0
/// \file
/// Incidents of a log, and of rows as they come.
#pragma once

#include <cstddef>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "commission/detection.hpp"
#include "commission/event_isolation.hpp"
#include "core/log.hpp"
#include "detector/events.hpp"
#include "detector/incidents.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::commission {

/// Joins the events of both residuals of `log` to incidents, in the order of their alarms. `isolations` are those of
/// the first events of the torque residual (isolate_events()); further ones, and those of the kinematic residual, are
/// isolated here as IncidentRecorder::asks() for them, one walk of the log each.
[[nodiscard]] std::vector<detector::Incident> join_events(LogSource& log, const OnlineModel& model,
                                                          const Detection& detection,
                                                          const std::vector<detector::Isolation>& isolations,
                                                          const KinematicWatch& kinematic,
                                                          const EventIsolationOptions& options = {});

/// What is left of incidents, of `detection` and `kinematic`, whose faults need not be steps. Walks `log` once, holds
/// the rows from some seconds before to 1 s behind incidents that lie within 180 s.
///
/// - Incidents that one fault explains which only grows are joined.
/// - Incident::sizes is filled: what both residuals say of the size over time of each fault of the catalogue that has
///   one. Faults that no course of the size explains are left out, and so are those of which nothing is known.
/// - Candidates are the faults that explain all of the incident as steps or as faults that grow; where there are none,
///   or where it is likelier by far, those whose size rose and fell. **Of a step or a fault that only grows the true
///   kind is never lost.** Readings that are said to stand still, and do not until the incident's end, are left out.
///   A candidate whose best course takes more than a second to come is told as one that grows, with its band.
/// - They are ordered by the cost of their best course (detector/faults/course_fit.hpp): an estimate, no proof. A
///   reading that stands still for a second and more while the robot moves comes first.
void explain_courses(LogSource& log, const OnlineModel& model, const Detection& detection,
                     const KinematicWatch& kinematic, std::vector<detector::Incident>& incidents,
                     std::size_t threads = 1);

/// The columns of rows that isolations of `model` look at: those of the torque residual, and with `kinematic` of the
/// kinematic one.
[[nodiscard]] std::vector<std::string> isolation_columns(const OnlineModel& model, bool kinematic);

/// The same on rows as they come. Holds the rows that an isolation looks at, some seconds of them, and one incident.
/// An event is isolated IsolationOptions::after seconds past its alarm, without sums at a stated risk: these need the
/// whole log.
class IncidentWatch {
 public:
  /// What an event did that opened an incident or narrowed it, and that incident.
  struct Told {
    detector::IncidentRecorder::Change change;
    detector::Incident incident;
    std::optional<detector::Incident> closed;  ///< the one before
  };

  /// For rows with isolation_columns(model, kinematic).
  explicit IncidentWatch(const OnlineModel& model, bool kinematic = false);
  /// The next row, before what it alarms; `restarts` where a segment begins with it.
  void row(double t, const std::vector<double>& sample, bool restarts);
  /// An event that the last row raised, of either residual.
  void event(const detector::Event& event);
  /// What has been settled up to the last row; with `all` all there is.
  [[nodiscard]] std::vector<Told> settle(bool all = false);
  /// An alarm stands at time `t`: the open incident lasts.
  void lasts(double t) { recorder_.lasts(t); }
  /// The incident that is open.
  [[nodiscard]] const std::optional<detector::Incident>& open() const { return recorder_.open(); }

 private:
  OnlineModel model_;
  EventIsolationOptions options_;
  double keep_;  // s
  LogTable rows_;
  std::deque<detector::Event> waiting_;
  detector::IncidentRecorder recorder_;
};

}  // namespace wheelwright::commission

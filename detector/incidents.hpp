// SPDX-License-Identifier: Apache-2.0
/// \file
/// Incidents: events that one fault explains, joined.
///
/// The class of faults behind it: **one cause, a step that stays**, of one size from one onset on, of a kind that the
/// catalogue has. isolate() never excludes such a fault at any event, and its size and onset lie in the intervals of
/// each. So its kind is a candidate of every event that was examined, and size and onset lie in what is common to their
/// intervals: **of that class the true fault is never lost, whatever rows, restarts of the filter and residuals lie
/// between the events**, and where nothing is common the cause is none of that class (Incident::stays is false). The
/// candidates are then those of the last events that agree, from IncidentCandidate::since on: a fault that grew and
/// then stayed is among them, of several faults perhaps the last. It is no proof, and is said so.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "detector/events.hpp"
#include "detector/faults/isolation.hpp"

namespace wheelwright::detector {

/// Courses of a fault's size over time, the narrowest class first.
enum class CourseClass {
  step,     ///< of one size from one onset on
  growing,  ///< of one sign, its amount never falls
  any       ///< any bounded one
};

/// A fault that may have caused the events of an incident that were examined.
struct IncidentCandidate {
  FaultFinding finding;  ///< size and onset that are left when these events are taken together; of a course that is no
                         ///< step the size at the end, and an onset no later than the incident's start
  bool changes = false;  ///< it explains no more than the last events, or those with another size or onset
  std::size_t events = 1;  ///< examined ones that `finding` explains, all of them or the last; 0: not the last
  double since = 0.0;      ///< alarm of the first of these, s
  CourseClass course = CourseClass::step;  ///< the narrowest class of courses that is not excluded
  /// Cost of the best course less that of the likeliest candidate's (course_fit.hpp); nothing where it was not asked,
  /// or is not known. `left`: what that course leaves, `guess`: its size at the end.
  std::optional<double> behind{}, left{}, guess{};
  bool as_likely = false;  ///< the data do not tell it from the first (less than 20 times as likely)
};

/// Events that one fault explains, or that came too soon one after the other to be told apart.
struct Incident {
  double start = 0.0;           ///< first instant outside, s
  double alarm = 0.0;           ///< first alarm, s
  double end = 0.0;             ///< last instant outside, s
  std::size_t events = 0;       ///< number of events, of either residual
  std::size_t examined = 0;     ///< of these, isolated
  std::size_t unexplained = 0;  ///< of these, explained by no fault that was examined
  bool stays = true;  ///< false: proved to be no one step of the catalogue that stays (where `examined` is not 0)
  double last_examined = 0.0;  ///< alarm of the last that was isolated, s
  /// Those that are left, ranked: first what is not excluded at the stated risk, then what needs one size only, then
  /// those that change by the number of events that they explain, then by the width of the size's interval relative to
  /// its middle. The order is no proof.
  std::vector<IncidentCandidate> candidates;
  /// Sizes over time of faults that may have caused it, steps or not; empty where they were not asked for. Where they
  /// were, candidates are of all courses (commission::explain_courses()), the likeliest first.
  std::vector<SizeOverTime> sizes{};
};

/// Options of IncidentRecorder.
struct IncidentOptions {
  double quiet = 10.0;        ///< s: an event that no fault of the incident explains belongs to it if that ended no
                              ///< longer ago
  std::size_t all_up_to = 8;  ///< so many events of an incident are all examined
  double patience = 0.25;     ///< later ones when this share of the incident's age has passed since the last
};

/// Joins events, in the order of their alarms. Holds one incident: the open one.
///
/// An event belongs to the open incident where some candidate explains it, too, with a size and an onset that it may
/// have in all events before. Where none does it belongs to it if it comes soon (IncidentOptions::quiet), and the
/// incident is then none of one fault that stays: of its candidates those are kept that explain both with another size
/// or onset, and where there are none those that explain this event, marked as changing. Where it comes later another
/// incident is opened. An event that was not asked for (asks()) always belongs to it.
class IncidentRecorder {
 public:
  /// What an event did.
  enum class Change {
    opened,    ///< it is the first of a new incident
    narrowed,  ///< the incident's faults are fewer, it got its first ones, or it is none of one fault that stays
    extended   ///< nothing but the number of events and the end
  };
  /// What came of an event.
  struct Outcome {
    Change change = Change::opened;
    std::optional<Incident> closed{};  ///< the incident before, where another was opened
  };

  /// Nothing is open.
  explicit IncidentRecorder(IncidentOptions options = {}) : options_(options) {}
  /// Whether an event with this alarm should be isolated before it is added.
  [[nodiscard]] bool asks(const Event& event) const;
  /// True if a candidate of the open incident is among those of `isolation` in a way that the event belongs to the
  /// incident by. What add() does then does not depend on what `isolation` says of faults that are no candidates.
  [[nodiscard]] bool goes_on(const Event& event, const Isolation& isolation) const;
  /// Takes the next event, with its isolation where there is one; `asked` is false where asks() was, or where the event
  /// cannot be isolated.
  Outcome add(const Event& event, const Isolation* isolation, bool asked = true);
  /// The open incident lasts up to `t`, s.
  void lasts(double t) {
    if (open_ && t > open_->end) {
      open_->end = t;
    }
  }
  /// The open incident.
  [[nodiscard]] const std::optional<Incident>& open() const { return open_; }

 private:
  Outcome take(const Event& event, const Isolation& isolation);

  IncidentOptions options_;
  std::optional<Incident> open_;
};

}  // namespace wheelwright::detector

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Incidents: events that one fault explains, joined.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "detector/events.hpp"
#include "detector/faults/isolation.hpp"

namespace wheelwright::detector {

/// A fault that may have caused all events of an incident that were examined.
struct IncidentCandidate {
  FaultFinding finding;  ///< size and onset that are left when all these events are taken together
  bool changes = false;  ///< no one size explains them all: `finding` has that of the last
};

/// Events that one fault explains.
struct Incident {
  double start = 0.0;           ///< first instant outside, s
  double alarm = 0.0;           ///< first alarm, s
  double end = 0.0;             ///< last instant outside, s
  std::size_t events = 0;       ///< number of events, of either residual
  std::size_t examined = 0;     ///< of these, isolated
  std::size_t unexplained = 0;  ///< of these, explained by no fault that was examined
  double last_examined = 0.0;   ///< alarm of the last that was isolated, s
  /// Those that are left, ranked: first what is not excluded at the stated risk, then what needs one size only, then by
  /// the width of the size's interval relative to its middle. The order is no proof.
  std::vector<IncidentCandidate> candidates;
};

/// Options of IncidentRecorder.
struct IncidentOptions {
  double quiet = 10.0;        ///< s: an event without an explanation belongs to an incident that ended no longer ago
  std::size_t all_up_to = 8;  ///< so many events of an incident are all examined
  double patience = 0.25;     ///< later ones when this share of the incident's age has passed since the last
};

/// Joins events, in the order of their alarms. Holds one incident: the open one.
///
/// An event belongs to the open incident where some candidate explains it, too: that fault is consistent with the data
/// around it, and its onset may lie where the incident's does. Where none does, another incident is opened. An event
/// that nothing examined explains, or that was not examined, belongs to it where it comes soon
/// (IncidentOptions::quiet); one that was not asked for (asks()) belongs to it always. Under the hypothesis of one
/// fault at a time the true one stays among the candidates as isolate() never excludes it; a fault whose size changes
/// is kept, with the last size.
class IncidentRecorder {
 public:
  /// What an event did.
  enum class Change {
    opened,    ///< it is the first of a new incident
    narrowed,  ///< the incident's faults are fewer, or it got its first ones
    extended   ///< nothing but the number of events and the end
  };
  /// What came of an event.
  struct Outcome {
    Change change = Change::opened;
    std::optional<Incident> closed{};  ///< the incident before, where another was opened
  };

  /// Nothing is open.
  explicit IncidentRecorder(IncidentOptions options = {}) : options_(options) {}
  /// Whether an event of the torque residual with this alarm should be isolated before it is added.
  [[nodiscard]] bool asks(const Event& event) const;
  /// Takes the next event, with its isolation where there is one; `asked` is false where asks() was.
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
  IncidentOptions options_;
  std::optional<Incident> open_;
};

}  // namespace wheelwright::detector

// SPDX-License-Identifier: Apache-2.0
#include "detector/incidents.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "core/limits.hpp"

namespace wheelwright::detector {
namespace {

using Candidates = std::vector<IncidentCandidate>;

Candidates consistent_of(const Isolation& isolation, double alarm) {
  Candidates out;
  for (const FaultFinding& finding : isolation.findings) {
    if (finding.verdict == FaultFinding::Verdict::consistent) {
      out.push_back({.finding = finding, .changes = false, .events = 1, .since = alarm});
    }
  }
  return out;
}

std::optional<Interval> common(const Interval& a, const Interval& b) {
  const Interval both{std::max(a.lower, b.lower), std::min(a.upper, b.upper)};
  return both.lower <= both.upper ? std::optional<Interval>(both) : std::nullopt;
}

Interval onsets(const FaultFinding& finding) {
  return {finding.earlier ? -core::kInfinity : finding.onset.lower, finding.onset.upper};
}

// The onset that both allow; true if there is one.
bool narrow_onset(FaultFinding& finding, const FaultFinding& later) {
  const std::optional<Interval> onset = common(onsets(finding), onsets(later));
  if (!onset) {
    return false;
  }
  finding.earlier = finding.earlier && later.earlier;
  finding.onset.upper = onset->upper;
  if (!finding.earlier) {
    finding.onset.lower = onset->lower;
  }
  return true;
}

// The size that both allow; true if there is one.
bool narrow_size(std::optional<Interval>& magnitude, const std::optional<Interval>& later) {
  if (!magnitude || !later) {
    magnitude = magnitude ? magnitude : later;
    return true;
  }
  const std::optional<Interval> both = common(*magnitude, *later);
  magnitude = both ? *both : *later;
  return both.has_value();
}

// What sums leave, alike.
void narrow_at_risk(FaultFinding& finding, const FaultFinding& later) {
  if (!finding.at_risk || !later.at_risk) {
    finding.at_risk = finding.at_risk ? finding.at_risk : later.at_risk;
    return;
  }
  SumFinding& now = *finding.at_risk;
  now.excluded = now.excluded || later.at_risk->excluded;
  if (now.excluded) {
    return;
  }
  const std::optional<Interval> onset = common(now.onset, later.at_risk->onset);
  now.excluded = !onset || !narrow_size(now.magnitude, later.at_risk->magnitude);
  now.onset = onset.value_or(now.onset);
}

// What is left of a candidate when a later event allows `later` of the same kind. A drift is another one while it
// grows: only its onset is compared. Where the two set in at two times nothing is left, or, with `again`, the later
// one; where their sizes differ, the later one.
std::optional<IncidentCandidate> both(const IncidentCandidate& now, const IncidentCandidate& later, bool again) {
  IncidentCandidate left = now;
  FaultFinding& finding = left.finding;
  const bool same_onset = narrow_onset(finding, later.finding);
  if (!same_onset && !again) {
    return std::nullopt;
  }
  const bool steps = finding.fault.profile.jumps();
  if (now.events == 0 || !same_onset || (steps && !narrow_size(finding.magnitude, later.finding.magnitude))) {
    left = later;
    left.changes = true;
    return left;
  }
  finding.complete = finding.complete || (steps && later.finding.complete);
  narrow_at_risk(finding, later.finding);
  ++left.events;
  return left;
}

Candidates common(const Candidates& now, const Candidates& later, bool again) {
  Candidates out;
  for (const IncidentCandidate& candidate : now) {
    const auto other = std::ranges::find(later, candidate.finding.fault.name,
                                         [](const IncidentCandidate& c) { return c.finding.fault.name; });
    if (other != later.end()) {
      if (auto left = both(candidate, *other, again)) {
        out.push_back(std::move(*left));
      }
    }
  }
  return out;
}

bool any_stays(const Candidates& candidates) {
  return std::ranges::any_of(candidates, [](const IncidentCandidate& c) { return !c.changes; });
}

void rank(Candidates& candidates) {
  const auto key = [](const IncidentCandidate& c) {
    const std::optional<Interval>& size = c.finding.magnitude;
    const double middle = size ? 0.5 * std::abs(size->lower + size->upper) : 0.0;
    const double width = !size ? 1.0 : middle > 0.0 ? (size->upper - size->lower) / middle : core::kInfinity;
    const bool excluded = c.finding.at_risk && c.finding.at_risk->excluded;
    return std::tuple(excluded, c.changes, c.changes ? -static_cast<double>(c.events) : 0.0, width);
  };
  std::stable_sort(candidates.begin(), candidates.end(),
                   [&](const IncidentCandidate& a, const IncidentCandidate& b) { return key(a) < key(b); });
}

Incident opened_by(const Event& event) {
  Incident incident;
  incident.start = event.start;
  incident.alarm = event.alarm;
  incident.end = event.end;
  return incident;
}

}  // namespace

bool IncidentRecorder::asks(const Event& event) const {
  return !open_ || open_->examined < options_.all_up_to ||
         event.alarm - open_->last_examined >= options_.patience * (event.alarm - open_->alarm);
}

bool IncidentRecorder::goes_on(const Event& event, const Isolation& isolation) const {
  if (!open_) {
    return false;
  }
  const Candidates found = consistent_of(isolation, event.alarm);
  const bool soon = open_->examined == 0 || event.start - open_->end <= options_.quiet;
  return !common(open_->candidates, found, false).empty() || (soon && !common(open_->candidates, found, true).empty());
}

// The candidates after an event that was examined; another incident is opened where it is of another fault.
IncidentRecorder::Outcome IncidentRecorder::take(const Event& event, const Isolation& isolation) {
  Candidates found = consistent_of(isolation, event.alarm);
  Outcome outcome{.change = Change::extended};
  if (open_) {
    Incident& now = *open_;
    // Where nothing was examined yet, nothing speaks against it.
    const bool soon = now.examined == 0 || event.start - now.end <= options_.quiet;
    Candidates left = common(now.candidates, found, false);
    if (soon && left.empty()) {
      left = common(now.candidates, found, true);
    }
    if (soon && left.empty()) {
      left = found.empty() ? now.candidates : found;
      for (IncidentCandidate& candidate : left) {
        candidate.changes = candidate.changes || now.examined > 0;
        candidate.events = found.empty() ? 0 : 1;
      }
    }
    if (soon || !left.empty()) {
      const bool stays = any_stays(left), fewer = left.size() != now.candidates.size();
      outcome.change = fewer || stays != now.stays ? Change::narrowed : Change::extended;
      now.stays = stays;
      now.candidates = std::move(left);
    } else {
      outcome = {.change = Change::opened, .closed = std::exchange(open_, std::nullopt)};
    }
  } else {
    outcome.change = Change::opened;
  }
  if (!open_) {
    open_ = opened_by(event);
    open_->stays = !found.empty();
    open_->candidates = found;
  }
  ++open_->examined;
  open_->unexplained += found.empty() ? 1 : 0;
  open_->last_examined = event.alarm;
  rank(open_->candidates);
  return outcome;
}

IncidentRecorder::Outcome IncidentRecorder::add(const Event& event, const Isolation* isolation, bool asked) {
  Outcome outcome{.change = Change::extended};
  if (isolation != nullptr) {
    outcome = take(event, *isolation);
  } else if (!open_ || (asked && event.start - open_->end > options_.quiet)) {
    outcome = {.change = Change::opened, .closed = std::exchange(open_, std::nullopt)};
    open_ = opened_by(event);
  }
  open_->start = std::min(open_->start, event.start);
  open_->end = std::max(open_->end, event.end);
  ++open_->events;
  return outcome;
}

}  // namespace wheelwright::detector

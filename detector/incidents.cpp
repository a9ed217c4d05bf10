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

Candidates consistent_of(const Isolation& isolation) {
  Candidates out;
  for (const FaultFinding& finding : isolation.findings) {
    if (finding.verdict == FaultFinding::Verdict::consistent) {
      out.push_back({.finding = finding});
    }
  }
  return out;
}

std::optional<Interval> common(const Interval& a, const Interval& b) {
  const Interval both{std::max(a.lower, b.lower), std::min(a.upper, b.upper)};
  return both.lower <= both.upper ? std::optional<Interval>(both) : std::nullopt;
}

// Sizes that both leave; of the later one, and `changes`, where there are none.
void narrow_size(std::optional<Interval>& magnitude, const std::optional<Interval>& later, bool& changes) {
  if (magnitude && later) {
    const std::optional<Interval> both = changes ? std::nullopt : common(*magnitude, *later);
    changes = !both;
    magnitude = both ? *both : *later;
  }
}

// What is left of a candidate when a later event allows `later` of the same fault; nothing where its onset cannot be
// that of the incident. A fault that does not jump is another one while it grows: only its onset is compared.
std::optional<IncidentCandidate> both(IncidentCandidate now, const FaultFinding& later) {
  FaultFinding& finding = now.finding;
  if (!later.earlier) {
    const Interval known{finding.earlier ? -core::kInfinity : finding.onset.lower, finding.onset.upper};
    const std::optional<Interval> onset = common(known, later.onset);
    if (!onset) {
      return std::nullopt;
    }
    finding.onset = *onset;
    finding.earlier = false;
  }
  if (finding.fault.profile.jumps()) {
    narrow_size(finding.magnitude, later.magnitude, now.changes);
    finding.complete = finding.complete || later.complete;
  }
  if (!finding.at_risk) {
    finding.at_risk = later.at_risk;
  } else if (later.at_risk) {
    finding.at_risk->excluded = finding.at_risk->excluded || later.at_risk->excluded;
    bool differ = now.changes;
    narrow_size(finding.at_risk->magnitude, later.at_risk->magnitude, differ);
  }
  return now;
}

Candidates common(const Candidates& now, const Candidates& later) {
  Candidates out;
  for (const IncidentCandidate& candidate : now) {
    for (const IncidentCandidate& other : later) {
      if (candidate.finding.fault.name == other.finding.fault.name) {
        if (auto left = both(candidate, other.finding)) {
          out.push_back(std::move(*left));
        }
      }
    }
  }
  return out;
}

void rank(Candidates& candidates) {
  const auto key = [](const IncidentCandidate& c) {
    const std::optional<Interval>& size = c.finding.magnitude;
    const double middle = size ? 0.5 * std::abs(size->lower + size->upper) : 0.0;
    const double width = !size ? 1.0 : middle > 0.0 ? (size->upper - size->lower) / middle : core::kInfinity;
    return std::tuple(c.finding.at_risk && c.finding.at_risk->excluded, c.changes, width);
  };
  std::stable_sort(candidates.begin(), candidates.end(),
                   [&](const IncidentCandidate& a, const IncidentCandidate& b) { return key(a) < key(b); });
}

}  // namespace

bool IncidentRecorder::asks(const Event& event) const {
  return !open_ || open_->examined < options_.all_up_to ||
         event.alarm - open_->last_examined >= options_.patience * (event.alarm - open_->alarm);
}

IncidentRecorder::Outcome IncidentRecorder::add(const Event& event, const Isolation* isolation, bool asked) {
  Candidates found = isolation != nullptr ? consistent_of(*isolation) : Candidates{};
  Outcome outcome;
  if (open_) {
    const bool soon = event.start - open_->end <= options_.quiet;
    const bool first = open_->examined == open_->unexplained;  // nothing has been explained yet
    Candidates left = first && soon ? found : common(open_->candidates, found);
    if (!asked || (found.empty() ? soon : !left.empty())) {
      if (!found.empty()) {
        outcome.change = left.size() != open_->candidates.size() ? Change::narrowed : Change::extended;
        open_->candidates = std::move(left);
      } else {
        outcome.change = Change::extended;
      }
    } else {
      outcome.closed = std::exchange(open_, std::nullopt);
    }
  }
  if (!open_) {
    open_ = Incident{.start = event.start, .alarm = event.alarm, .end = event.end, .candidates = found};
  }
  open_->start = std::min(open_->start, event.start);
  open_->end = std::max(open_->end, event.end);
  ++open_->events;
  if (isolation != nullptr) {
    ++open_->examined;
    open_->unexplained += found.empty() ? 1 : 0;
    open_->last_examined = event.alarm;
  }
  rank(open_->candidates);
  return outcome;
}

}  // namespace wheelwright::detector

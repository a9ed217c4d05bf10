// SPDX-License-Identifier: Apache-2.0
#include "commission/watch/incident_watch.hpp"

#include <algorithm>
#include <span>
#include <utility>

namespace wheelwright::commission {
namespace {

constexpr double kMostEvent = 10.0;  // s between the first instant outside and the alarm that rows are held for

detector::Isolation isolate_one(LogSource& log, const OnlineModel& model, const detector::Event& event,
                                const EventIsolationOptions& options) {
  return isolate_events(log, model, std::span(&event, 1), options).front();
}

// About the open incident's candidates first: the other faults are asked about only where the event is another one's.
detector::Isolation isolate_next(LogSource& log, const OnlineModel& model, const detector::Event& event,
                                 const detector::IncidentRecorder& recorder, const EventIsolationOptions& options) {
  if (recorder.open() && !recorder.open()->candidates.empty()) {
    EventIsolationOptions some = options;
    for (const detector::IncidentCandidate& candidate : recorder.open()->candidates) {
      some.only.push_back(candidate.finding.fault.name);
    }
    detector::Isolation isolation = isolate_one(log, model, event, some);
    if (recorder.goes_on(event, isolation)) {
      return isolation;
    }
  }
  return isolate_one(log, model, event, options);
}

}  // namespace

std::vector<detector::Incident> join_events(LogSource& log, const OnlineModel& model, const Detection& detection,
                                            const std::vector<detector::Isolation>& isolations,
                                            const KinematicWatch& kinematic, const EventIsolationOptions& options) {
  struct Next {
    const detector::Event* event;
    std::optional<std::size_t> torque;  // its number among the torque residual's
  };
  std::vector<Next> order;
  for (std::size_t k = 0; k < detection.events.size(); ++k) {
    order.push_back({&detection.events[k], k});
  }
  if (kinematic.detection) {
    for (const detector::Event& event : kinematic.detection->events) {
      order.push_back({&event, std::nullopt});
    }
  }
  std::ranges::stable_sort(order, {}, [](const Next& next) { return next.event->alarm; });
  detector::IncidentRecorder recorder;
  std::vector<detector::Incident> out;
  for (const Next& next : order) {
    const bool known = next.torque && *next.torque < isolations.size();
    const bool asked = known || recorder.asks(*next.event);
    std::optional<detector::Isolation> own;
    if (asked && !known) {
      own = isolate_next(log, model, *next.event, recorder, options);
    }
    auto outcome = recorder.add(*next.event, known ? &isolations[*next.torque] : own ? &*own : nullptr, asked);
    if (outcome.closed) {
      out.push_back(std::move(*outcome.closed));
    }
  }
  if (recorder.open()) {
    out.push_back(*recorder.open());
  }
  return out;
}

std::vector<std::string> isolation_columns(const OnlineModel& model, bool kinematic) {
  std::vector<std::string> names = model.measurement.columns();
  if (kinematic && model.kinematic) {
    for (const std::string& name : model.kinematic->measurement.columns()) {
      if (std::ranges::find(names, name) == names.end()) {
        names.push_back(name);
      }
    }
  }
  return names;
}

IncidentWatch::IncidentWatch(const OnlineModel& model, bool kinematic)
    : model_(model),
      keep_(isolation_memory(model) + options_.isolation.before + options_.isolation.after + kMostEvent) {
  model_.at_risk.reset();
  rows_.names = isolation_columns(model, kinematic);
  rows_.columns.resize(rows_.names.size());
}

void IncidentWatch::row(double t, const std::vector<double>& sample, bool restarts) {
  if (rows_.rows() > 1 && rows_.t.back() - rows_.t.front() > 2.0 * keep_ && waiting_.empty()) {
    const auto old = std::ranges::find_if(rows_.t, [&](double at) { return at >= rows_.t.back() - keep_; });
    rows_ = core::slice(rows_, static_cast<std::size_t>(old - rows_.t.begin()), rows_.rows());
  }
  if (restarts && !rows_.t.empty() && waiting_.empty()) {
    rows_ = core::slice(rows_, rows_.rows(), rows_.rows());
  }
  if (restarts) {
    rows_.segment_starts.push_back(rows_.rows());
  }
  rows_.t.push_back(t);
  for (std::size_t c = 0; c < sample.size(); ++c) {
    rows_.columns[c].push_back(sample[c]);
  }
}

void IncidentWatch::event(const detector::Event& event) { waiting_.push_back(event); }

std::vector<IncidentWatch::Told> IncidentWatch::settle(bool all) {
  std::vector<Told> told;
  while (!waiting_.empty()) {
    detector::Event event = waiting_.front();
    const bool asked = recorder_.asks(event);
    const double past = rows_.t.back() - event.alarm;
    if (asked && !all && past >= 0.0 && past < options_.isolation.after) {
      break;
    }
    std::optional<detector::Isolation> isolation;
    if (asked && event.alarm - event.start <= kMostEvent) {
      const auto last = std::ranges::find(rows_.t.rbegin(), rows_.t.rend(), event.start);
      if (last != rows_.t.rend()) {
        event.start_sample = static_cast<std::size_t>(rows_.t.rend() - last) - 1;
        TableSource log(rows_);
        isolation = isolate_next(log, model_, event, recorder_, options_);
      }
    }
    auto outcome = recorder_.add(event, isolation ? &*isolation : nullptr, asked);
    if (outcome.change != detector::IncidentRecorder::Change::extended) {
      told.push_back({outcome.change, *recorder_.open(), std::move(outcome.closed)});
    }
    waiting_.pop_front();
  }
  return told;
}

}  // namespace wheelwright::commission

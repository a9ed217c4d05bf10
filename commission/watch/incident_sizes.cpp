// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "commission/event_isolation.hpp"
#include "commission/watch/incident_watch.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "detector/faults/course_fit.hpp"
#include "detector/faults/odometry_isolation.hpp"
#include "detector/faults/reference_motion.hpp"
#include "detector/faults/size_over_time.hpp"
#include "detector/online_model.hpp"

namespace wheelwright::commission {
namespace {

using detector::CourseClass;
using detector::Incident;
using detector::IncidentCandidate;

constexpr double kBefore = 3.0, kBehind = 1.0, kLongest = 180.0;  // s
constexpr double kHealthy = 4.0;                                  // s before that, that a fit knows no fault of
constexpr double kFitted = 60.0;                                  // s of an incident, that courses are fitted to
constexpr double kMostOfIt = 0.9;                                 // of the largest amount that is certain
constexpr double kLikelier = 3.0;                                 // 20 times as likely
constexpr double kStill = 1.0;                                    // s
constexpr double kSlowly = 1.0;                                   // s: what takes longer to come is told as growing
constexpr std::size_t kMostMoments = 60, kMostTries = 8, kRows = 240;

// Rows of a log with times in [from, to].
struct Stretch {
  double from = 0.0, to = 0.0;
  LogTable table{};
};

void gather_stretches(LogSource& log, std::vector<Stretch>& stretches) {
  for (Stretch& stretch : stretches) {
    stretch.table.names = log.columns();
    stretch.table.columns.resize(log.columns().size());
  }
  core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) {
    for (Stretch& stretch : stretches) {
      LogTable& table = stretch.table;
      if (block.t[k] < stretch.from || block.t[k] > stretch.to) {
        continue;
      }
      if (starts || table.t.empty()) {
        table.segment_starts.push_back(table.rows());
      }
      table.t.push_back(block.t[k]);
      for (std::size_t c = 0; c < table.columns.size(); ++c) {
        table.columns[c].push_back(block.columns[c][k]);
      }
    }
  });
}

// Amount that is certain: 0 where either sign is possible.
double certain(const Interval& size) { return std::max({0.0, size.lower, -size.upper}); }

// A log, or a piece of it, as both residuals read it.
struct Reading {
  Reading(const LogTable& rows, const OnlineModel& online, std::size_t processes)
      : table(rows),
        model(online),
        threads(processes),
        filter(online.model, online.filter, online.measurement, online.errors),
        set(online.facets, online.box) {
    TableSource log(table);
    motion = detector::read_reference(log, filter);
    efforts.resize(static_cast<Eigen::Index>(model.measurement.effort_columns.size()),
                   static_cast<Eigen::Index>(motion.instants()));
    for (Eigen::Index j = 0; j < efforts.rows(); ++j) {
      const std::vector<double>& column = table.column(model.measurement.effort_columns[static_cast<std::size_t>(j)]);
      for (std::size_t k = 0; k < motion.instants(); ++k) {
        efforts(j, static_cast<Eigen::Index>(k)) = column[motion.sample[k]];
      }
    }
    if (model.kinematic && std::ranges::all_of(model.kinematic->measurement.columns(),
                                               [&](const std::string& name) { return log.find(name).has_value(); })) {
      odometry = detector::read_odometry(log, detector::make_filter(*model.kinematic), model.model);
      lengths.emplace(model.kinematic->facets, model.kinematic->box);
      if (odometry->motion.instants() == 0) {
        odometry.reset();
      }
    }
    for (FaultType& fault : model::fault_catalogue(model.model, model.estimate, model.robot.effort)) {
      using Kind = FaultProfile::Kind;
      const bool step = fault.profile.kind == Kind::step;
      if (step || fault.profile.kind == Kind::ramp) {
        fitted.push_back(fault);
      }
      if (step && !fault.whole) {
        sized.push_back(std::move(fault));
      }
    }
  }

  const LogTable& table;
  const OnlineModel& model;
  std::size_t threads;
  RegressorFilter filter;
  Polytope set;
  detector::ReferenceMotion motion;
  Eigen::MatrixXd efforts;
  std::optional<detector::OdometryReference> odometry;
  std::optional<Polytope> lengths;
  std::vector<FaultType> sized, fitted;
};

std::vector<detector::SizeOverTime> sizes_of(const Reading& in, const Interval& window, std::vector<double> moments) {
  const detector::SizeOptions options{.also = std::move(moments), .threads = in.threads};
  std::array<std::vector<detector::SizeEvidence>, 2> evidence;
  if (in.motion.instants() > 0) {
    evidence[0] = detector::size_evidence(in.motion, in.filter, in.efforts, in.set, in.sized, window, options);
  }
  if (in.odometry) {
    const detector::KinematicModel& kinematic = *in.model.kinematic;
    evidence[1] = detector::size_evidence_by_odometry(*in.odometry, in.model.model, kinematic.measurement,
                                                      kinematic.errors, *in.lengths, in.sized, window, options);
  }
  std::vector<detector::SizeOverTime> out;
  for (std::size_t k = 0; k < in.sized.size(); ++k) {
    std::vector<detector::SizeEvidence> both;
    for (const auto& each : evidence) {
      if (!each.empty()) {
        both.push_back(each[k]);
      }
    }
    detector::SizeOverTime size = detector::size_over_time(in.sized[k], both);
    if (!size.excluded && (!size.means.empty() || !size.growing.empty() || size.growing_excluded)) {
      out.push_back(std::move(size));
    }
  }
  return out;
}

bool grows(const detector::SizeOverTime& size) { return !size.growing_excluded && !size.growing.empty(); }

// Times at which events of either residual were furthest outside.
std::vector<double> moments_of(const Detection& detection, const KinematicWatch& kinematic) {
  std::vector<double> out;
  for (const detector::Event& event : detection.events) {
    out.insert(out.end(), {event.alarm, event.peak_time});
  }
  if (kinematic.detection) {
    for (const detector::Event& event : kinematic.detection->events) {
      out.insert(out.end(), {event.alarm, event.peak_time});
    }
  }
  std::ranges::sort(out);
  return out;
}

// At most so many of `moments` within the window, evenly spread.
std::vector<double> some_within(const std::vector<double>& moments, const Interval& window) {
  const auto first = std::ranges::lower_bound(moments, window.lower),
             last = std::ranges::upper_bound(moments, window.upper);
  const auto all = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, last - first));
  const std::size_t count = std::min(kMostMoments, all);
  std::vector<double> out;
  for (std::size_t k = 0; k < count; ++k) {
    out.push_back(*(first + static_cast<std::ptrdiff_t>(k * all / count)));
  }
  return out;
}

Interval window_of(const Incident& incident) {
  return {incident.start - kBefore, std::min(incident.end + kBehind, incident.start + kLongest)};
}

// Both incidents as one, of no fault that stays.
Incident joined(const Incident& a, const Incident& b) {
  Incident out = a;
  out.start = std::min(a.start, b.start);
  out.end = std::max(a.end, b.end);
  out.events += b.events;
  out.examined += b.examined;
  out.unexplained += b.unexplained;
  out.stays = false;
  out.last_examined = std::max(a.last_examined, b.last_examined);
  out.candidates = b.candidates;
  for (IncidentCandidate& candidate : out.candidates) {
    candidate.changes = true;
  }
  return out;
}

// Incidents of a reading, joined where one fault that only grows explains both.
std::vector<Incident> join_growing(const Reading& in, const std::vector<double>& moments,
                                   const std::vector<Incident>& incidents) {
  const auto explained = [&](const Incident& incident) {
    const Interval window = window_of(incident);
    return std::ranges::any_of(sizes_of(in, window, some_within(moments, window)), grows);
  };
  std::vector<Incident> out;
  if (incidents.size() > 2) {  // mostly all are of one
    Incident all = incidents.front();
    for (std::size_t k = 1; k < incidents.size(); ++k) {
      all = joined(all, incidents[k]);
    }
    if (explained(all)) {
      return {std::move(all)};
    }
  }
  std::size_t tries = 0;
  for (const Incident& incident : incidents) {
    if (!out.empty() && tries++ < kMostTries) {
      Incident both = joined(out.back(), incident);
      if (explained(both)) {
        out.back() = std::move(both);
        continue;
      }
    }
    out.push_back(incident);
  }
  return out;
}

// How long a reading that a fault says stands still does so before the incident ends, s, while it would be seen;
// nothing where it does not, or where it is no such fault.
std::optional<double> stands_still(const Reading& in, const Incident& incident, const detector::FaultFinding& finding) {
  const FaultType& fault = finding.fault;
  const bool effort = fault.effort.size() > 0, encoder = fault.seen.size() > 0;
  if (!fault.whole || fault.profile.kind != FaultProfile::Kind::step || effort == encoder) {
    return std::nullopt;
  }
  const Model& model = in.model.model;
  const Eigen::MatrixXd& map = effort ? model.input : model.motion;
  const Eigen::MatrixXd of_joints = core::pseudo_inverse(map) * (effort ? fault.effort : fault.seen) * map;
  Eigen::Index joint = 0;
  of_joints.diagonal().cwiseAbs().maxCoeff(&joint);
  const std::vector<std::string>& columns =
      effort ? in.model.measurement.effort_columns : in.model.measurement.motion_columns;
  const std::vector<double>& column = in.table.column(columns[static_cast<std::size_t>(joint)]);
  const double noise = effort ? in.model.robot.noise.effort.value.value_or(0.0) : 0.0;
  Interval held{0.0, 0.0}, others{0.0, 0.0};
  bool any = false;
  double from = 0.0, to = 0.0, largest = 0.0;
  for (std::size_t k = 0; k < in.table.rows(); ++k) {
    const double t = in.table.t[k];
    largest = std::max(largest, std::abs(column[k]));
    if (t < finding.onset.upper || t > incident.end) {
      continue;
    }
    double other = 0.0;
    for (const std::string& name : in.model.measurement.motion_columns) {
      if (name != columns[static_cast<std::size_t>(joint)]) {
        other = in.table.column(name)[k];
      }
    }
    if (!any) {
      held = {column[k], column[k]};
      others = {other, other};
      from = t;
      any = true;
    }
    to = t;
    held = {std::min(held.lower, column[k]), std::max(held.upper, column[k])};
    others = {std::min(others.lower, other), std::max(others.upper, other)};
  }
  const double slack = 2.0 * noise + 1e-6 * largest;
  const bool still = !any || (fault.held_effort || encoder ? held.width() <= slack : core::magnitude(held) <= slack);
  if (!still) {
    return -1.0;
  }
  return others.width() > 0.0 ? to - from : 0.0;
}

// Takes a class for a step that it is proved not to be, or whose best course takes long to come.
void widen_course(const Incident& incident, const detector::CourseFit& fit, double before,
                  IncidentCandidate& candidate) {
  const auto size = std::ranges::find(incident.sizes, candidate.finding.fault.name,
                                      [](const detector::SizeOverTime& s) { return s.fault.name; });
  if (candidate.course != CourseClass::step || size == incident.sizes.end()) {
    return;
  }
  if (size->growing_excluded) {
    candidate.course = CourseClass::any;
    candidate.finding.magnitude = size->fault.range;
  } else if (fit.known && fit.grows && fit.rise > kSlowly && !size->growing.empty()) {
    candidate.course = CourseClass::growing;
    candidate.finding.magnitude = size->growing.back().size;
  } else {
    return;
  }
  candidate.finding.onset = {before, incident.start};
  candidate.finding.earlier = true;
  candidate.finding.at_risk.reset();
}

// The likeliest first, by how well their courses fit.
void order(const Reading& in, Incident& incident) {
  const Interval window = {incident.start - kBefore - kHealthy,
                           std::min(incident.end + kBehind, incident.start + kFitted)};
  const detector::CourseGrid grid = detector::course_grid(window, incident.start);
  std::vector<FaultType> faults;
  for (const IncidentCandidate& candidate : incident.candidates) {
    faults.push_back(candidate.finding.fault);
  }
  std::vector<detector::CourseRows> rows;
  if (in.motion.instants() > 0) {
    rows.push_back(detector::course_rows(in.motion, in.filter, in.model.estimate, in.set, faults, window, grid, kRows,
                                         in.threads));
  }
  if (in.odometry) {
    const detector::KinematicModel& kinematic = *in.model.kinematic;
    rows.push_back(detector::course_rows_by_odometry(*in.odometry, in.model.model, kinematic.measurement,
                                                     kinematic.errors, kinematic.window, kinematic.estimate,
                                                     *in.lengths, faults, window, grid, kRows));
  }
  std::erase_if(rows, [](const detector::CourseRows& r) { return r.residual.size() == 0; });
  const std::vector<detector::CourseFit> fits = detector::fit_courses(faults, grid, rows);
  std::vector<double> cost(faults.size(), core::kInfinity);
  for (std::size_t k = 0; k < faults.size(); ++k) {
    IncidentCandidate& candidate = incident.candidates[k];
    if (const auto still = stands_still(in, incident, candidate.finding); still && *still >= kStill) {
      cost[k] = -core::kInfinity;
    } else if (fits[k].known) {
      cost[k] = fits[k].cost;
      candidate.left = fits[k].left;
      candidate.guess = fits[k].size;
    }
  }
  // A course that falls has to be likelier by far than one of a narrower class.
  double narrow = core::kInfinity;
  for (std::size_t k = 0; k < faults.size(); ++k) {
    narrow = incident.candidates[k].course != CourseClass::any ? std::min(narrow, cost[k]) : narrow;
  }
  std::vector<std::size_t> sorted;
  for (std::size_t k = 0; k < faults.size(); ++k) {
    if (incident.candidates[k].course != CourseClass::any || cost[k] < narrow - kLikelier) {
      sorted.push_back(k);
    }
  }
  if (sorted.empty()) {
    for (std::size_t k = 0; k < faults.size(); ++k) {
      sorted.push_back(k);
    }
  }
  // A reading of zero is a special case of one that stays.
  std::ranges::stable_sort(sorted, {}, [&](std::size_t k) { return std::pair(cost[k], faults[k].held_effort); });
  std::vector<IncidentCandidate> ordered;
  for (const std::size_t k : sorted) {
    IncidentCandidate candidate = incident.candidates[k];
    const double first = cost[sorted.front()];
    widen_course(incident, fits[k], window.lower, candidate);
    if (std::isfinite(cost[k]) && std::isfinite(first)) {
      candidate.behind = cost[k] - first;
      candidate.as_likely = !ordered.empty() && *candidate.behind < kLikelier;
    } else {
      candidate.as_likely = !ordered.empty() && cost[k] == first;
    }
    ordered.push_back(std::move(candidate));
  }
  incident.candidates = std::move(ordered);
}

// Candidates of all courses, in order.
void take_courses(const Reading& in, const std::vector<double>& moments, Incident& incident) {
  const Interval window = window_of(incident);
  incident.sizes = sizes_of(in, window, some_within(moments, window));
  std::vector<IncidentCandidate> candidates;
  const auto has = [&](const std::string& name) {
    return std::ranges::any_of(candidates, [&](const IncidentCandidate& c) { return c.finding.fault.name == name; });
  };
  for (const IncidentCandidate& candidate : incident.candidates) {
    if (!candidate.changes && incident.stays && stands_still(in, incident, candidate.finding).value_or(0.0) >= 0.0) {
      candidates.push_back(candidate);
    }
  }
  const auto add = [&](const detector::SizeOverTime& size, CourseClass course) {
    IncidentCandidate candidate;
    candidate.finding.fault = size.fault;
    candidate.finding.verdict = detector::FaultFinding::Verdict::consistent;
    candidate.finding.onset = {window.lower, incident.start};
    candidate.finding.earlier = true;
    candidate.changes = true;
    candidate.events = incident.examined;
    candidate.since = incident.alarm;
    candidate.course = course;
    candidate.finding.magnitude = course == CourseClass::growing ? size.growing.back().size : size.fault.range;
    candidates.push_back(std::move(candidate));
  };
  for (const detector::SizeOverTime& size : incident.sizes) {
    if (grows(size) && !has(size.fault.name)) {
      add(size, CourseClass::growing);
    }
  }
  for (const detector::SizeOverTime& size : incident.sizes) {
    if (!has(size.fault.name)) {
      add(size, CourseClass::any);
    }
  }
  if (!candidates.empty()) {
    incident.candidates = std::move(candidates);
    order(in, incident);
  }
}

}  // namespace

void explain_courses(LogSource& log, const OnlineModel& model, const Detection& detection,
                     const KinematicWatch& kinematic, std::vector<Incident>& incidents, std::size_t threads) {
  const std::vector<double> moments = moments_of(detection, kinematic);
  std::vector<Stretch> stretches;
  std::vector<std::vector<Incident>> groups;
  for (Incident& incident : incidents) {
    const double end = std::min(incident.end + kBehind, incident.start + kLongest);
    if (stretches.empty() || end > groups.back().front().start + kLongest) {
      stretches.push_back({incident.start - kBefore - kHealthy - isolation_memory(model), end});
      groups.emplace_back();
    }
    stretches.back().to = std::max(stretches.back().to, end);
    groups.back().push_back(std::move(incident));
  }
  incidents.clear();
  if (groups.empty()) {
    return;
  }
  gather_stretches(log, stretches);
  for (std::size_t k = 0; k < groups.size(); ++k) {
    const Reading reading(stretches[k].table, model, threads);
    std::vector<Incident> left =
        groups[k].size() > 1 ? join_growing(reading, moments, groups[k]) : std::move(groups[k]);
    for (Incident& incident : left) {
      take_courses(reading, moments, incident);
      incidents.push_back(std::move(incident));
    }
  }
}

std::string sentence(const detector::SizeOverTime& size) {
  std::string text;
  // Where most of what is certain is known first.
  const auto best = [](const auto& series, const auto& interval) {
    double most = 0.0;
    for (const auto& each : series) {
      most = std::max(most, certain(interval(each)));
    }
    return most > 0.0 ? std::ranges::find_if(
                            series, [&](const auto& each) { return certain(interval(each)) >= kMostOfIt * most; })
                      : series.end();
  };
  if (const auto mean = best(size.means, [](const detector::MeanSize& m) { return m.size; });
      mean != size.means.end()) {
    text = fmt::format("whatever its course{} on average over the {:.2f} s before {:.2f} s",
                       size_words(mean->size, size.fault), mean->to - mean->from, mean->to);
  }
  if (const auto at = best(size.growing, [](const detector::SizeAt& s) { return s.size; }); at != size.growing.end()) {
    text += fmt::format("{}if it only grew{} at {:.2f} s", text.empty() ? "" : "; ", size_words(at->size, size.fault),
                        at->t);
  }
  return text;
}

}  // namespace wheelwright::commission

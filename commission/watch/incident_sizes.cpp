// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "commission/event_isolation.hpp"
#include "commission/watch/incident_watch.hpp"
#include "detector/faults/odometry_isolation.hpp"
#include "detector/faults/reference_motion.hpp"
#include "detector/faults/size_over_time.hpp"
#include "detector/online_model.hpp"

namespace wheelwright::commission {
namespace {

constexpr double kBefore = 3.0, kBehind = 1.0, kLongest = 120.0;  // s
constexpr double kMostOfIt = 0.9;                                 // of the largest amount that is certain

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

std::vector<detector::SizeOverTime> sizes_of(const LogTable& table, const OnlineModel& model, const Interval& window,
                                             const detector::SizeOptions& options) {
  TableSource log(table);
  std::vector<FaultType> faults;
  for (FaultType& fault : model::fault_catalogue(model.model, model.estimate, model.robot.effort)) {
    using Kind = FaultProfile::Kind;
    if (!fault.whole && fault.profile.kind == Kind::step) {
      faults.push_back(std::move(fault));
    }
  }
  const RegressorFilter filter(model.model, model.filter, model.measurement, model.errors);
  const detector::ReferenceMotion motion = detector::read_reference(log, filter);
  Eigen::MatrixXd efforts(static_cast<Eigen::Index>(model.measurement.effort_columns.size()),
                          static_cast<Eigen::Index>(motion.instants()));
  for (Eigen::Index j = 0; j < efforts.rows(); ++j) {
    const std::vector<double>& column = table.column(model.measurement.effort_columns[static_cast<std::size_t>(j)]);
    for (std::size_t k = 0; k < motion.instants(); ++k) {
      efforts(j, static_cast<Eigen::Index>(k)) = column[motion.sample[k]];
    }
  }
  std::array<std::vector<detector::SizeEvidence>, 2> evidence;
  if (motion.instants() > 0) {
    evidence[0] =
        detector::size_evidence(motion, filter, efforts, Polytope(model.facets, model.box), faults, window, options);
  }
  if (model.kinematic && std::ranges::all_of(model.kinematic->measurement.columns(),
                                             [&](const std::string& name) { return log.find(name).has_value(); })) {
    const detector::KinematicModel& kinematic = *model.kinematic;
    const detector::OdometryReference reference =
        detector::read_odometry(log, detector::make_filter(kinematic), model.model);
    if (reference.motion.instants() > 0) {
      evidence[1] =
          detector::size_evidence_by_odometry(reference, model.model, kinematic.measurement, kinematic.errors,
                                              Polytope(kinematic.facets, kinematic.box), faults, window, options);
    }
  }
  std::vector<detector::SizeOverTime> out;
  for (std::size_t k = 0; k < faults.size(); ++k) {
    std::vector<detector::SizeEvidence> both;
    for (const auto& each : evidence) {
      if (!each.empty()) {
        both.push_back(each[k]);
      }
    }
    detector::SizeOverTime size = detector::size_over_time(faults[k], both);
    if (!size.excluded && (!size.means.empty() || !size.growing.empty() || size.growing_excluded)) {
      out.push_back(std::move(size));
    }
  }
  return out;
}

// Amount that is certain: 0 where either sign is possible.
double certain(const Interval& size) { return std::max({0.0, size.lower, -size.upper}); }

}  // namespace

void add_sizes(LogSource& log, const OnlineModel& model, std::vector<detector::Incident>& incidents,
               std::size_t threads) {
  std::vector<Stretch> stretches;
  std::vector<std::size_t> of;
  for (std::size_t k = 0; k < incidents.size(); ++k) {
    const detector::Incident& incident = incidents[k];
    if (incident.examined > 0) {
      of.push_back(k);
      stretches.push_back({incident.start - kBefore - isolation_memory(model),
                           std::min(incident.end + kBehind, incident.start + kLongest)});
    }
  }
  if (of.empty()) {
    return;
  }
  gather_stretches(log, stretches);
  for (std::size_t k = 0; k < of.size(); ++k) {
    detector::Incident& incident = incidents[of[k]];
    incident.sizes =
        sizes_of(stretches[k].table, model, {incident.start - kBefore, stretches[k].to}, {.threads = threads});
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

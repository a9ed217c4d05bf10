// SPDX-License-Identifier: Apache-2.0
#include "commission/margin_survey.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "commission/at_risk/risk_reach.hpp"
#include "commission/watch/risk_watch.hpp"
#include "core/check.hpp"
#include "core/error.hpp"
#include "core/for_all.hpp"
#include "detector/faults/odometry_faults.hpp"
#include "detector/faults/smallest_certain.hpp"
#include "detector/multiscale/pose_margins.hpp"

namespace wheelwright::commission {
namespace {

constexpr std::array kKinds = {detector::ManoeuvreKind::standstill, detector::ManoeuvreKind::cruising,
                               detector::ManoeuvreKind::accelerating, detector::ManoeuvreKind::turning,
                               detector::ManoeuvreKind::spinning};

std::vector<FaultType> chosen(const std::vector<FaultType>& catalogue, const std::vector<std::string>& names) {
  if (names.empty()) {
    return catalogue;
  }
  std::vector<FaultType> faults;
  for (const std::string& name : names) {
    faults.push_back(model::find_fault(catalogue, name));
  }
  return faults;
}

// Whether efforts, or motion, take part in a fault's signature.
bool moves(const FaultType& f) { return f.motion.size() > 0 || f.slip.size() > 0 || f.lateral != 0.0; }

std::vector<double> axis(double largest, std::size_t points) {
  std::vector<double> values;
  for (std::size_t k = 0; k < points; ++k) {
    values.push_back(largest * (2.0 * static_cast<double>(k) / static_cast<double>(points - 1) - 1.0));
  }
  return values;
}

// Largest acceleration of each coordinate over tenths of a second: single differences would show the encoder.
Eigen::VectorXd largest_accelerations(const detector::ReferenceMotion& motion) {
  const double step = core::median_step(motion.instant);
  const auto gap = std::max<Eigen::Index>(1, static_cast<Eigen::Index>(std::lround(0.1 / step)));
  Eigen::VectorXd largest = Eigen::VectorXd::Zero(motion.speed.rows());
  for (Eigen::Index k = gap; k < motion.speed.cols(); ++k) {
    const double h = motion.instant[static_cast<std::size_t>(k)] - motion.instant[static_cast<std::size_t>(k - gap)];
    const bool together =
        std::upper_bound(motion.segment_starts.begin(), motion.segment_starts.end(),
                         static_cast<std::size_t>(k - gap)) ==
        std::upper_bound(motion.segment_starts.begin(), motion.segment_starts.end(), static_cast<std::size_t>(k));
    if (together) {
      largest = largest.cwiseMax((motion.speed.col(k) - motion.speed.col(k - gap)).cwiseAbs() / h);
    }
  }
  return largest;
}

std::vector<FaultMaps> maps_of(const std::vector<detector::FaultMargins>& margins,
                               const detector::ReferenceMotion& motion, const OnlineModel& model,
                               const detector::ThresholdRule& rule, const MarginSurveyOptions& options) {
  std::vector<FaultMaps> maps(options.map_points > 1 ? margins.size() : 0);
  const Eigen::VectorXd speed = motion.speed.cwiseAbs().rowwise().maxCoeff();
  const Eigen::VectorXd acceleration = largest_accelerations(motion);
  const Eigen::VectorXd typical = (motion.speed.array().square().rowwise().mean()).sqrt();
  const bool plane = speed.size() > 1;
  const auto values = [&](const Eigen::VectorXd& most, Eigen::Index c) {
    return c > 0 && !plane ? std::vector<double>{0.0} : axis(std::max(most[c], 1e-6), options.map_points);
  };
  core::for_all(maps.size(), options.margins.threads, [&](std::size_t i) {
    const detector::FaultMargins& each = margins[i];
    const auto map = [&](const detector::OperatingPlane& on) {
      return detector::operating_map(each.fault, each.side, model.model, model.filter, model.errors, rule, on);
    };
    maps[i] = {each.fault.name, each.side, map({false, values(speed, 0), values(speed, 1)}),
               map({true, values(acceleration, 0), values(acceleration, 1), typical})};
  });
  return maps;
}

// Those that leave a trace in a pose.
bool shows_in_pose(const FaultType& fault) { return moves(fault) || fault.seen.size() > 0; }

// The smaller of both sizes, onset by onset and window by window.
void take_smaller(std::vector<detector::FaultMargins>& all, const std::vector<detector::FaultMargins>& others) {
  for (const detector::FaultMargins& other : others) {
    const auto own = std::ranges::find_if(all, [&](const detector::FaultMargins& each) {
      return each.fault.name == other.fault.name && each.side == other.side;
    });
    for (std::size_t k = 0; k < other.onsets.size(); ++k) {
      std::vector<double>& certain = own->onsets[k].certain;
      const std::vector<double>& there = other.onsets[k].certain;
      certain.resize(std::max(certain.size(), there.size()), core::kInfinity);
      for (std::size_t w = 0; w < there.size(); ++w) {
        certain[w] = std::min(certain[w], there[w]);
      }
    }
  }
}

// Margins at the stated risk, from some of the onsets of `worst_case`.
void add_at_risk(MarginSurvey& survey, LogSource& log, const OnlineModel& model,
                 const detector::ReferenceMotion& motion, const std::vector<FaultType>& faults,
                 const std::vector<detector::OnsetMargin>& worst_case, const MarginSurveyOptions& options) {
  const bool of_pose = watches_pose(log, model);
  if (!model.at_risk && !of_pose) {
    survey.without_risk = "the model says nothing at a stated risk (docs/methods/risk.md)";
    return;
  }
  if (options.risk_onsets == 0) {
    survey.without_risk = "it was not asked for";
    return;
  }
  const std::optional<detector::SumDrive> drive =
      model.at_risk ? detector::read_sum_drive(log, model, motion) : std::nullopt;
  if (!drive && !of_pose) {
    survey.without_risk = "what the sensors may write of this drive leaves no bound on the motion between samples";
    return;
  }
  std::vector<std::size_t> onsets;
  std::vector<double> times;
  std::vector<detector::ManoeuvreKind> kinds;
  const std::size_t stride = (worst_case.size() + options.risk_onsets - 1) / options.risk_onsets;
  for (std::size_t k = 0; k < worst_case.size(); k += stride) {
    onsets.push_back(worst_case[k].instant);
    times.push_back(worst_case[k].t);
    kinds.push_back(worst_case[k].kind);
  }
  detector::SumMarginOptions sums;
  sums.windows = options.margins.windows;
  for (const double window : {1.0, 5.0, 10.0, 20.0}) {
    const auto at = std::ranges::lower_bound(sums.windows, window);
    if (at == sums.windows.end() || *at != window) {
      sums.windows.insert(at, window);
    }
  }
  sums.threads = options.margins.threads;
  sums.progress = options.margins.progress;
  RiskMargins result;
  result.windows = sums.windows;
  if (drive) {
    result.torque = true;
    result.risk = model.at_risk->risk;
    result.miss = drive->miss;
    result.false_alarms = torque_false_alarms(model);
    result.warrant = model.at_risk->warrant;
    result.margins = detector::margins_at_risk(*drive, model, motion, faults, onsets, sums);
  } else {
    result.margins = detector::sides_of(faults, onsets.size());
    for (detector::FaultMargins& margins : result.margins) {
      for (std::size_t k = 0; k < onsets.size(); ++k) {
        margins.onsets[k].instant = onsets[k];
        margins.onsets[k].t = times[k];
      }
    }
  }
  if (of_pose) {
    std::vector<FaultType> visible;
    std::ranges::copy_if(faults, std::back_inserter(visible), shows_in_pose);
    const detector::PoseSumDrive poses = detector::read_pose_drive(log, *model.kinematic, pose_false_alarms(model));
    result.risk += model.kinematic->at_risk->risk;
    result.miss = std::max(result.miss, poses.miss);
    result.false_alarms += pose_false_alarms(model);
    result.pose = detector::pose_margins_at_risk(poses, *model.kinematic, model.model, visible, times, sums);
    take_smaller(result.margins, result.pose);
  }
  for (std::vector<detector::FaultMargins>* all : {&result.margins, &result.pose}) {
    for (detector::FaultMargins& margins : *all) {
      for (std::size_t k = 0; k < kinds.size(); ++k) {
        margins.onsets[k].kind = kinds[k];
      }
    }
  }
  survey.at_risk = std::move(result);
}

}  // namespace

MarginSurvey survey_margins(LogSource& log, const OnlineModel& model, const MarginSurveyOptions& options) {
  MarginSurvey survey;
  detector::MarginOptions margins = options.margins;
  margins.persistence = options.persistence.value_or(model.persistence);
  survey.windows = margins.windows;
  survey.persistence = margins.persistence;
  survey.noise_share = margins.noise_share;
  survey.assumptions = model.assumptions;
  const std::vector<FaultType> faults =
      chosen(model::fault_catalogue(model.model, model.estimate, model.robot.effort), options.faults);

  const detector::ReferenceMotion motion =
      detector::read_reference(log, RegressorFilter(model.model, model.filter, model.measurement, model.errors));
  check::that(std::find(motion.settled.begin(), motion.settled.end(), true) != motion.settled.end(), "log",
              "a stretch that is long enough for the filter to settle");
  for (std::size_t k = 1; k < motion.instants(); ++k) {
    survey.seconds += std::binary_search(motion.segment_starts.begin(), motion.segment_starts.end(), k)
                          ? 0.0
                          : motion.t[k] - motion.t[k - 1];
  }
  ResidualMargins torque{.name = "torque",
                         .outputs = model.model.outputs,
                         .margins = {},
                         .blind = {},
                         .maps = {},
                         .warrant = model.warrant};
  const detector::ThresholdRule rule(Polytope(model.facets, model.box), model.estimate, options.set);
  torque.margins = detector::margins_along(
      motion, faults, rule,
      [&](const FaultType& fault) {
        return std::make_unique<detector::FaultFilter>(fault, model.model, model.filter, motion);
      },
      margins);
  torque.maps = maps_of(torque.margins, motion, model, rule, options);
  for (const detector::ManoeuvreKind kind : kKinds) {
    const auto& onsets = torque.margins.front().onsets;
    const auto count = std::count_if(onsets.begin(), onsets.end(),
                                     [&](const detector::OnsetMargin& onset) { return onset.kind == kind; });
    if (count > 0) {
      survey.manoeuvres.emplace_back(kind, static_cast<std::size_t>(count));
    }
  }
  add_at_risk(survey, log, model, motion, faults, torque.margins.front().onsets, options);
  survey.residuals.push_back(std::move(torque));

  if (!model.kinematic) {
    survey.without_kinematic = model.model.coordinates.size() < 2
                                   ? "only a robot with two driven wheels has one"
                                   : "the log that was commissioned with had neither a pose nor a gyro";
    return survey;
  }
  const detector::KinematicModel& k = *model.kinematic;
  for (const std::string& column : k.measurement.columns()) {
    if (!log.find(column)) {
      survey.without_kinematic = "the log has no column '" + column + "'";
      return survey;
    }
  }
  ResidualMargins kinematic{.name = "kinematic",
                            .outputs = k.measurement.outputs(),
                            .margins = {},
                            .blind = {},
                            .maps = {},
                            .warrant = k.warrant};
  std::vector<FaultType> visible;
  for (const FaultType& fault : faults) {
    if (shows_in_pose(fault)) {
      visible.push_back(fault);
    } else {
      kinematic.blind.push_back(fault.name);
    }
  }
  const detector::OdometryReference seen =
      detector::read_odometry(log, filter::OdometryFilter(k.measurement, k.window, k.errors), model.model);
  const bool settled =
      std::find(seen.motion.settled.begin(), seen.motion.settled.end(), true) != seen.motion.settled.end();
  if (!settled) {
    survey.without_kinematic = "no stretch of the log is as long as its window";
    return survey;
  }
  margins.persistence = options.persistence.value_or(k.persistence);
  kinematic.margins = detector::margins_along(
      seen.motion, visible, detector::ThresholdRule(Polytope(k.facets, k.box), k.estimate, options.set),
      [&](const FaultType& fault) {
        return std::make_unique<detector::OdometryFaultRows>(fault, model.model, k.measurement, seen, k.box);
      },
      margins);
  survey.residuals.push_back(std::move(kinematic));
  return survey;
}

std::vector<std::string> telling_faults(const OnlineModel& model) {
  const std::vector<FaultType> catalogue = model::fault_catalogue(model.model, model.estimate, model.robot.effort);
  std::vector<std::string> names;
  for (const model::FaultKind kind :
       {model::FaultKind::wheel_radius, model::FaultKind::effort_loss, model::FaultKind::effort_bias}) {
    const auto first = std::ranges::find_if(
        catalogue, [&](const FaultType& fault) { return fault.name.starts_with(to_string(kind)); });
    if (first != catalogue.end()) {
      names.push_back(first->name);
    }
  }
  return names;
}

std::optional<MarginSurvey> first_look(LogSource& log, const OnlineModel& model, std::size_t threads) {
  constexpr double kMost = 600.0;      // s of the log
  constexpr std::size_t kOnsets = 30;  // a glance, not the survey
  MarginSurveyOptions options;
  options.faults = telling_faults(model);
  options.map_points = 0;
  options.margins.threads = threads;
  options.margins.windows = {0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0};
  options.margins.most_onsets = options.risk_onsets = kOnsets;
  std::vector<std::string> columns = model.measurement.columns();
  if (model.kinematic) {
    for (const std::string& column : model.kinematic->measurement.columns()) {
      if (log.find(column) && std::ranges::find(columns, column) == columns.end()) {
        columns.push_back(column);
      }
    }
  }
  const LogTable beginning = beginning_of(log, columns, kMost);
  TableSource source(beginning);
  try {
    return survey_margins(source, model, options);
  } catch (const InvalidArgument&) {
    return std::nullopt;
  }
}

}  // namespace wheelwright::commission

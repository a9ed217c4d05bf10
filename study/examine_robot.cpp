// SPDX-License-Identifier: Apache-2.0
#include "study/examine_robot.hpp"

#include <algorithm>
#include <cmath>
#include <exception>

#include <fmt/format.h>

#include "commission/physical.hpp"
#include "commission/watch/detector_walk.hpp"
#include "detector/online_model.hpp"

namespace wheelwright::study {
namespace {

std::optional<double> finite(const std::optional<double>& x) { return x && std::isfinite(*x) ? x : std::nullopt; }

RobotStatus status_of(Commissioning::Status status) {
  switch (status) {
    case Commissioning::Status::done: return RobotStatus::commissioned;
    case Commissioning::Status::partial: return RobotStatus::partial;
    case Commissioning::Status::empty:
    case Commissioning::Status::contradicted: return RobotStatus::contradicted;
    case Commissioning::Status::nothing: return RobotStatus::nothing;
  }
  return RobotStatus::nothing;
}

// [lower, upper] / unit, outward; a side of exactly 0 stays.
Interval over(double lower, double upper, double unit) {
  const double a = lower / unit, b = upper / unit;
  const double low = std::min(a, b), high = std::max(a, b);
  return {low == 0.0 ? 0.0 : core::round_down(low), high == 0.0 ? 0.0 : core::round_up(high)};
}

LogRecord record_of(const FleetLog& log, const Commissioning& result) {
  return {.log = log.name,
          .when = log.when,
          .status = status_of(result.status),
          .message = result.message,
          .seconds = result.survey.seconds,
          .rows = result.survey.rows,
          .parameters = recorded_parameters(result)};
}

LogRecord failure_of(const FleetLog& log, const char* message) {
  return {.log = log.name, .when = log.when, .status = RobotStatus::unreadable, .message = message};
}

void take_outputs(RobotRecord& record, const Commissioning& result) {
  double kappa = INFINITY;
  for (std::size_t i = 0; i < result.validation.size(); ++i) {
    const commission::OutputValidation& v = result.validation[i];
    if (v.instants == 0) {
      continue;
    }
    record.outputs.push_back({.name = result.model.model.outputs[i],
                              .unit = commission::output_unit(result.model.robot, result.model.model.output_units[i]),
                              .median_width = v.median_width,
                              .instants = v.instants,
                              .false_alarms = v.outside});
    kappa = std::min(kappa, v.smallest_kappa);
  }
  if (result.model.robot.wheel_radius > 0.0 && kappa <= 1.0) {
    record.smallest_radius_change = std::sqrt(1.0 + kappa) - 1.0;
  }
}

void take_events(CheckRecord& check, const std::vector<detector::Event>& events) {
  check.events += events.size();
  for (const detector::Event& event : events) {
    check.first = std::min(check.first.value_or(event.alarm), event.alarm);
  }
}

// Why a log counts as not looked at; empty where it does.
std::string why_not_watched(const Detection& torque, const OnlineModel& model, double step, std::size_t met) {
  switch (how_watched(torque, model, step, met)) {
    case commission::Watched::enough: return {};
    case commission::Watched::little:
      return fmt::format("only {} of {} rows could be decided on", torque.instants, met);
    case commission::Watched::no_time:
      return fmt::format("its rows are {:.4g} s apart, by a clock that hardly goes on", step);
    case commission::Watched::nothing:
      return fmt::format("no instant of its {} rows, {:.4g} s apart, could be decided on", met, step);
  }
  return {};
}

// The detector's walk. A kinematic residual is watched where the log has its columns. A fault that is seen counts,
// however little else was.
void watch(CheckRecord& check, const OpenedLog& opened, const OnlineModel& model,
           const detector::DetectorOptions& options) {
  LogSource& log = *opened.log;
  const commission::DetectionOptions thin{.most_points = 2};
  const Detection torque = detect(log, make_detector(model, options), thin);
  check.instants = torque.instants;
  for (const std::size_t outside : torque.outside) {
    const double share =
        torque.instants > 0 ? static_cast<double>(outside) / static_cast<double>(torque.instants) : 0.0;
    check.outside_share = std::max(check.outside_share, share);
  }
  take_events(check, torque.events);
  if (model.kinematic) {
    const auto columns = model.kinematic->measurement.columns();
    if (std::all_of(columns.begin(), columns.end(), [&](const std::string& c) { return log.find(c).has_value(); })) {
      take_events(check, detect(log, make_detector(*model.kinematic, options), thin).events);
    }
  }
  check.not_checked =
      check.events > 0 ? "" : why_not_watched(torque, model, log.median_step(), std::max(opened.met, torque.rows));
  check.checked = check.not_checked.empty();
}

CheckRecord check_log(const FleetLog& log, const std::optional<OnlineModel>& model, const ExamineOptions& options) {
  CheckRecord check;
  check.not_checked = model ? "" : "the robot has no commissioned model";
  OpenedLog opened;
  try {
    opened = log.open();
  } catch (const std::exception& error) {
    check.log = failure_of(log, error.what());
    check.not_checked = error.what();
    return check;
  }
  if (model) {
    try {
      watch(check, opened, *model, options.detector);
    } catch (const std::exception& error) {
      check = {};
      check.not_checked = error.what();
    }
  }
  try {
    check.log = record_of(log, commission_robot(*opened.log, opened.robot, options.commission));
  } catch (const std::exception& error) {
    check.log = failure_of(log, error.what());
  }
  return check;
}

}  // namespace

std::vector<RecordedParameter> recorded_parameters(const Commissioning& result) {
  std::vector<RecordedParameter> out;
  if (!result.has_model()) {
    return out;
  }
  const Robot& robot = result.model.robot;
  const bool physical = model::effort_per_torque(robot).has_value();
  for (std::size_t j = 0; j < result.parameters.size(); ++j) {
    const commission::ParameterResult& p = result.parameters[j];
    const double unit = physical ? p.parameter.per_physical : 1.0;
    const Interval bounds = over(p.lower, p.upper, unit);
    const Interval prior =
        j < result.prior.sides.size() ? over(result.prior.sides[j].lower, result.prior.sides[j].upper, unit) : bounds;
    const std::optional<double> estimate = finite(p.estimate), error = finite(p.standard_error);
    out.push_back({.name = physical ? p.parameter.physical : p.parameter.name,
                   .unit = physical ? p.parameter.physical_unit : commission::parameter_unit(robot, p.parameter),
                   .is_prior_key = physical,
                   .estimate = estimate ? std::optional(*estimate / unit) : std::nullopt,
                   .standard_error = error ? std::optional(*error / std::abs(unit)) : std::nullopt,
                   .freedom = error ? std::optional(std::max(result.residuals.freedom, 1.0)) : std::nullopt,
                   .lower = bounds.lower,
                   .upper = bounds.upper,
                   .lower_is_prior = p.lower_is_prior,
                   .upper_is_prior = p.upper_is_prior,
                   .prior = prior,
                   .warrant = p.warrant});
  }
  for (const commission::KinematicParameter& p :
       result.kinematic.model ? result.kinematic.parameters : std::vector<commission::KinematicParameter>{}) {
    if (!std::isfinite(p.lower) || !std::isfinite(p.upper)) {
      continue;
    }
    const bool shown = p.excitation == identify::Excitation::identified;
    out.push_back({.name = "kinematic." + p.name,
                   .unit = p.unit == "1" ? "" : p.unit,
                   .estimate = shown ? finite(p.estimate) : std::nullopt,
                   .standard_error = shown ? finite(p.standard_error) : std::nullopt,
                   .lower = p.lower,
                   .upper = p.upper,
                   .lower_is_prior = !shown,
                   .upper_is_prior = !shown,
                   .prior = {p.lower, p.upper},
                   .warrant = p.warrant});
  }
  return out;
}

RobotRecord examine_robot(const RobotLogs& logs, const ExamineOptions& options) {
  RobotRecord record{.robot = logs.robot, .dated = logs.dated, .commissioning = {}, .findings = logs.findings};
  std::optional<OnlineModel> model;
  try {
    const OpenedLog opened = logs.commissioning.open();
    const Commissioning result = commission_robot(*opened.log, opened.robot, options.commission);
    record.commissioning = record_of(logs.commissioning, result);
    record.notes = result.notes;
    if (result.has_model()) {
      take_outputs(record, result);
      model = result.model;
    }
  } catch (const std::exception& error) {
    record.commissioning = failure_of(logs.commissioning, error.what());
  }
  for (const FleetLog& log : logs.checks) {
    record.checks.push_back(check_log(log, model, options));
  }
  return record;
}

}  // namespace wheelwright::study

// SPDX-License-Identifier: Apache-2.0
#include "commission/design/subject.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "commission/design/plan.hpp"
#include "commission/noise_budget.hpp"
#include "commission/physical.hpp"
#include "commission/survey.hpp"
#include "core/check.hpp"
#include "core/error.hpp"
#include "detector/faults/reference_motion.hpp"
#include "model/filter/row_stream.hpp"

namespace wheelwright::design {
namespace {

// θ_L,j of the robot's nominal value, where it has one that can be expressed in the effort's unit.
std::optional<double> nominal_parameter(const Robot& robot, const Model& model, std::size_t j) {
  const auto found = robot.nominal.find(model.parameters[j].physical);
  const auto scales = commission::physical_scales(robot, model);
  if (found == robot.nominal.end() || !scales) {
    return std::nullopt;
  }
  return (found->second + (*scales)[j].offset) / (*scales)[j].scale;
}

// Of a robot of some 20 kg, for a user to replace.
double example_value(const std::string& unit) {
  constexpr std::pair<const char*, double> kValues[] = {{"kg", 20.0},       {"kg·m²", 0.8}, {"N·s/m", 4.0},
                                                        {"N·m·s/rad", 0.5}, {"N·m", 0.3},   {"N", 3.0}};
  const auto* const found = std::ranges::find(kValues, unit, &std::pair<const char*, double>::first);
  return found == std::end(kValues) ? 1.0 : found->second;
}

// The line of a robot file that says what is `unknown`, as far as planning needs it; empty where nothing is.
std::string nominal_line(const Robot& robot, const Model& model, const std::vector<std::size_t>& unknown) {
  std::string values, units;
  for (const std::size_t j : unknown) {
    const model::Parameter& parameter = model.parameters[j];
    if (!robot.nominal.contains(parameter.physical)) {
      values += fmt::format("{}{}: {}", values.empty() ? "" : ", ", parameter.physical,
                            example_value(parameter.physical_unit));
      units += (units.empty() ? "" : ", ") + parameter.physical_unit;
    }
  }
  return values.empty() ? "" : fmt::format("\n  nominal: {{{}}}  # {}; rough values will do", values, units);
}

// The same of the motor's constants.
std::string motor_line(const Robot& robot, const Model& model) {
  if (commission::physical_scales(robot, model)) {
    return "";
  }
  const bool voltage = robot.effort == model::EffortKind::voltage;
  return fmt::format(
      "\n  motor: {{torque_constant: 0.05, gear_ratio: 30{}}}  # N·m/A at the motor's shaft, turns of it for one of "
      "the wheel{}: efforts are in {}, nominal values are not",
      voltage ? ", resistance: 1.2, back_emf: 0.05" : "", voltage ? ", Ω, V·s/rad" : "", voltage ? "V" : "A");
}

std::string noise_line(const Robot& robot) {
  const bool wheels = model::on_two_wheels(robot);
  return fmt::format("\n  noise: {{{}, effort: 0.05}}  # bounds of the sensors' errors: {}, {}",
                     wheels ? "wheel_speed: 0.02" : "position: 0.001", wheels ? "rad/s" : "m (rotary: rad)",
                     commission::output_unit(robot, "N·m"));
}

[[noreturn]] void not_enough_known(const std::string& of, const std::string& lines) {
  throw InvalidArgument(of +
                        " does not say enough to plan with: expected in the robot file, each key once, with values of "
                        "your robot in place of these:" +
                        lines);
}

filter::SignalErrors worst_case_errors(const DesignSubject& subject, const Measurement& measurement,
                                       const commission::NoiseBudget& budget) {
  return filter::propagate(subject.model, subject.filter, measurement, budget.sensors);
}

// How the planned log is read: its own steps, speeds that need not be whole counts.
Measurement planned_measurement(const Plan& plan, const DesignSubject& subject) {
  Measurement m = subject.measurement;
  m.shortest_step *= m.nominal_step > 0.0 ? plan.step / m.nominal_step : 0.0;
  m.nominal_step = plan.step;
  m.count = 0.0;
  return m;
}

// `errors` of logs with the subject's steps as those of logs with the plan's.
filter::SignalErrors with_steps_of(const Plan& plan, const DesignSubject& subject, filter::SignalErrors errors) {
  if (subject.measurement.motion != MotionKind::speed && subject.measurement.nominal_step > 0.0) {
    const double longer = plan.step / subject.measurement.nominal_step;
    errors.joint_sample /= longer;
    errors.speed_sample /= longer;
  }
  return errors;
}

}  // namespace

DesignSubject subject_of(const OnlineModel& model) {
  DesignSubject subject;
  subject.robot = model.robot;
  subject.model = model.model;
  subject.measurement = model.measurement;
  subject.filter = model.filter;
  subject.theta = model.estimate;
  subject.effort_box = model.box;
  subject.known = model.box;
  subject.step = check::positive(model.measurement.nominal_step, "model: measurement.nominal_step");
  subject.prior.sides = model::prior_box(model.robot, model.model).bounds;
  std::vector<std::size_t> unknown;
  for (std::size_t j = 0; j < model.model.p(); ++j) {
    const Interval &side = model.box.sides[j], &prior = subject.prior.sides[j];
    if (side.upper - side.lower > 0.5 * (prior.upper - prior.lower)) {
      const auto nominal = nominal_parameter(model.robot, model.model, j);
      if (!nominal) {
        unknown.push_back(j);
        continue;
      }
      subject.theta[static_cast<Eigen::Index>(j)] = *nominal;
      subject.effort_box.sides[j] = {*nominal, *nominal};
    }
  }
  if (!unknown.empty()) {
    not_enough_known("the model, whose log did not show all parameters,",
                     nominal_line(model.robot, model.model, unknown) + motor_line(model.robot, model.model));
  }
  // A model from the statistical mode has smaller bounds than the worst case.
  const commission::NoiseBudget budget = commission::noise_budget(subject.robot, subject.measurement);
  const bool worst_case = budget.complete && (worst_case_errors(subject, subject.measurement, budget).output.array() <=
                                              model.errors.output.array() * (1.0 + 1e-9))
                                                 .all();
  if (!worst_case) {
    subject.errors = model.errors;
  }
  subject.warrant = model.warrant;
  if (model.at_risk) {
    subject.averaging = model.at_risk->errors;
    subject.averaging_warrant = model.at_risk->warrant;
  }
  return subject;
}

DesignSubject subject_of(const Robot& robot, double step, const FilterDesign& filter) {
  DesignSubject subject;
  subject.robot = robot;
  subject.model = model::make_model(robot);
  subject.step = check::positive(step, "step");
  subject.filter = filter;
  subject.filter.order = robot.filter.order.value_or(filter.order);
  if (robot.filter.beta) {
    subject.filter.beta = subject.filter.alpha = *robot.filter.beta;
  }
  subject.filter.alpha = robot.filter.alpha.value_or(subject.filter.alpha);
  filter::validate(subject.filter);
  subject.prior.sides = model::prior_box(robot, subject.model).bounds;
  subject.theta.resize(static_cast<Eigen::Index>(subject.model.p()));
  std::vector<std::size_t> unknown;
  for (std::size_t j = 0; j < subject.model.p(); ++j) {
    const auto nominal = nominal_parameter(robot, subject.model, j);
    if (!nominal) {
      unknown.push_back(j);
      continue;
    }
    subject.theta[static_cast<Eigen::Index>(j)] = *nominal;
    subject.effort_box.sides.push_back({*nominal, *nominal});
  }

  Measurement& m = subject.measurement;
  m.hold = robot.hold;
  m.changes = robot.effort_changes;
  m.delay = robot.effort_delay;
  m.smoothing = robot.effort_smoothing;
  m.nominal_step = step;
  const model::NoiseBound& angle_noise = !model::on_two_wheels(robot) ? robot.noise.position : robot.noise.wheel_angle;
  const bool angles = subject.filter.order == 2 && robot.speed_source != model::SpeedSource::measured &&
                      (angle_noise.value || robot.encoder_counts_per_turn);
  m.motion = angles ? MotionKind::angle : MotionKind::speed;
  for (const model::Joint& joint : subject.model.joints) {
    m.motion_columns.push_back(angles ? joint.angle : joint.speed);
    m.effort_columns.push_back("effort of " + joint.speed);
  }
  std::string lines;
  if (!unknown.empty()) {
    lines = nominal_line(robot, subject.model, unknown) + motor_line(robot, subject.model);
  }
  if (!commission::noise_budget(robot, m).complete) {
    lines += noise_line(robot);
  }
  if (!lines.empty()) {
    not_enough_known("the robot file", lines);
  }
  subject.averaging = commission::error_classes(robot, m);
  if (subject.averaging && !subject.averaging->average()) {
    subject.averaging.reset();
  }
  return subject;
}

LogTable planned_log(const Plan& plan, const DesignSubject& subject) {
  const Measurement& m = subject.measurement;
  const Eigen::MatrixXd joint = joint_speeds(plan, subject.model);
  const auto joints = static_cast<std::size_t>(joint.rows());
  const auto samples = static_cast<std::size_t>(plan.samples());
  const bool mean = m.motion == MotionKind::mean_speed;
  const std::size_t rows = mean ? samples - 1 : samples;
  LogTable log;
  log.names = m.columns();
  log.t.resize(rows);
  log.columns.assign(log.names.size(), std::vector<double>(rows, 0.0));
  log.segment_starts = {0};
  for (std::size_t k = 0; k < rows; ++k) {
    log.t[k] = plan.t(static_cast<Eigen::Index>(k)) + (mean ? 0.5 * plan.step : 0.0);
  }
  for (std::size_t i = 0; i < joints; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    double angle = 0.0;
    for (std::size_t k = 0; k < rows; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const double now = joint(row, at);
      const double between = at + 1 < joint.cols() ? 0.5 * (now + joint(row, at + 1)) : now;
      log.columns[i][k] = m.motion == MotionKind::angle ? angle : mean ? between : now;
      angle += plan.step * between;
    }
  }
  // A held effort acts in the step that begins with its sample.
  const EffortModel model(subject);
  const bool held = m.hold == Hold::zero_order;
  for (std::size_t k = 0; k < rows; ++k) {
    const auto at = static_cast<Eigen::Index>(k), next = std::min(at + 1, plan.speed.cols() - 1);
    const bool in_step = next > at && (held || mean);
    Eigen::VectorXd v = plan.speed.col(at), a = plan.acceleration.col(at);
    if (in_step) {
      a = (plan.speed.col(next) - v) / plan.step;
      v = 0.5 * (v + plan.speed.col(next));
    }
    const Eigen::VectorXd effort = model.believed(v, a, plan.pose(2, at));
    for (std::size_t i = 0; i < joints; ++i) {
      log.columns[joints + i][k] = effort[static_cast<Eigen::Index>(i)];
    }
  }
  if (!m.heading_column.empty()) {
    for (std::size_t k = 0; k < rows; ++k) {
      log.columns.back()[k] = plan.pose(2, static_cast<Eigen::Index>(k));
    }
  }
  return log;
}

RegressorFilter planned_filter(LogSource& log, const Plan& plan, const DesignSubject& subject) {
  const Measurement measurement = planned_measurement(plan, subject);
  filter::SignalErrors errors;
  if (subject.errors) {
    errors = with_steps_of(plan, subject, *subject.errors);
  } else {
    const commission::NoiseBudget budget = commission::noise_budget(subject.robot, subject.measurement);
    errors = worst_case_errors(subject, measurement, budget);
    errors.motion.limit = commission::coordinate_limit(
        subject.model, commission::acceleration_limit(subject.robot, commission::survey(log, measurement),
                                                      measurement.motion, budget.sensors.motion));
  }
  return RegressorFilter(subject.model, subject.filter, measurement, errors);
}

filter::ErrorClasses planned_classes(const Plan& plan, const DesignSubject& subject) {
  check::that(
      subject.averaging.has_value(), "promises at a stated risk: noise",
      "effort: {bound: …, bias: …} in the robot file, or a model that says something at a risk (docs/methods/risk.md)");
  filter::ErrorClasses classes = *subject.averaging;
  const double nominal = subject.measurement.nominal_step;
  classes.shortest_step = nominal > 0.0 ? classes.shortest_step * (plan.step / nominal) : plan.step;
  return classes;
}

RegressionBlock planned_rows(const Plan& plan, const DesignSubject& subject) {
  const LogTable log = planned_log(plan, subject);
  TableSource source(log);
  TorqueRows stream(source, planned_filter(source, plan, subject));
  RegressionBlock rows = read_all(stream);
  rows.y = rows.Y * subject.theta;
  return rows;
}

detector::ReferenceMotion planned_motion(const Plan& plan, const DesignSubject& subject) {
  const LogTable log = planned_log(plan, subject);
  TableSource source(log);
  detector::ReferenceMotion motion = detector::read_reference(source, planned_filter(source, plan, subject));
  motion.measured = false;
  return motion;
}

}  // namespace wheelwright::design

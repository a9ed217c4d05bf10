// SPDX-License-Identifier: Apache-2.0
/// \file
/// The robot that a manoeuvre is designed for: its assumed parameters, and the error bounds of its log.
#pragma once

#include <optional>

#include <Eigen/Core>

#include "bounds/box.hpp"
#include "core/log.hpp"
#include "core/regression.hpp"
#include "core/warrant.hpp"
#include "detector/learnt_model.hpp"
#include "model/filter/error_class.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/noise.hpp"
#include "model/robot.hpp"

namespace wheelwright::detector {
struct ReferenceMotion;
}  // namespace wheelwright::detector

namespace wheelwright::filter {
class RegressorFilter;
}  // namespace wheelwright::filter

namespace wheelwright::design {

struct Plan;

/// Robot data that planning needs. θ is used where it must be known beforehand: for the effort of a motion, and in the
/// terms dY|θ| of the rows' errors.
struct DesignSubject {
  Robot robot;
  Model model;
  Measurement measurement;
  FilterDesign filter;
  Eigen::VectorXd theta;  ///< θ°, θ_L as believed
  Box effort_box;         ///< θ_L for which effort limits must hold
  Box prior;              ///< in which bounds are sought, as commission_robot() does
  std::optional<filter::SignalErrors>
      errors;          ///< of the rows; nothing: from the declared noise and the planned acceleration
  double step = 0.01;  ///< sampling step of the log to come, s
  core::Warrant warrant = core::Warrant::guaranteed;  ///< of the promises: that of the model, or of the declared noise
  std::optional<filter::ErrorClasses>
      averaging;  ///< errors that average out, as declared or as the model has learnt them: promises at a stated risk
  core::Warrant averaging_warrant = core::Warrant::guaranteed;  ///< extrapolated where a log was what they came from

  /// The commissioned bounds, where there are any: what the manoeuvre is to improve on.
  std::optional<Box> known;
};

/// From a commissioned model. A parameter that its log did not show (its bounds are the prior's) takes the robot's
/// nominal value. Errors of the rows are worked out anew from declared noise, with the acceleration of the plan, where
/// the model stands on declared noise in the worst case; else they are the model's.
/// Throws InvalidArgument, with the line that the robot file lacks, where parameters are neither shown nor nominal.
[[nodiscard]] DesignSubject subject_of(const OnlineModel& model);

/// Before any log: nominal values and declared noise; effort limits hold at the nominal values. A log is expected to be
/// sampled every `step` seconds, with wheel angles where their noise or the encoder is known, else with speeds; a
/// filter that the robot file leaves open is taken as `filter`.
/// Throws InvalidArgument, with all lines that the robot file lacks, units and values of an example in them, unless
/// every parameter has a nominal value (for currents and voltages the motor's constants, too) and the noise of motion
/// and effort is declared.
[[nodiscard]] DesignSubject subject_of(const Robot& robot, double step, const FilterDesign& filter = {2, 10.0, 10.0});

/// The log along `plan` without noise: motion as the sensors see it, efforts as θ° needs them.
[[nodiscard]] LogTable planned_log(const Plan& plan, const DesignSubject& subject);

/// The filter of a planned log, which knows its steps, with the errors that its sensors will make.
[[nodiscard]] filter::RegressorFilter planned_filter(LogSource& log, const Plan& plan, const DesignSubject& subject);

/// DesignSubject::averaging for the steps of `plan`. Throws InvalidArgument where there is none.
[[nodiscard]] filter::ErrorClasses planned_classes(const Plan& plan, const DesignSubject& subject);

/// The rows that commissioning would make of a log driven exactly along `plan`, without noise: Y_f of the planned
/// motion, y = Y_f θ°, and the error bounds dY, dy that the sensors' noise gives, and what θ° needs of efforts may do
/// between samples. A plan may have other steps than the log to come: it is then read as a log with these steps.
[[nodiscard]] RegressionBlock planned_rows(const Plan& plan, const DesignSubject& subject);

/// The same drive as a reference motion for faults, with the error bounds of its rows.
[[nodiscard]] detector::ReferenceMotion planned_motion(const Plan& plan, const DesignSubject& subject);

}  // namespace wheelwright::design

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Local sensitivity: derivatives of every bound by an input of the robot file at its present value, and the robot and
/// filter at neighbouring values.
///
/// The rows that hold a bound are smooth functions of an input; their multipliers turn the rows' rates into the bound's
/// (hull_derivatives.hpp), pass by pass of commissioning (bound_rates.hpp). No linear program over the log is solved
/// again: per input and pass, the log is walked twice, for all bounds at once. Everything that commissioning chose from
/// the log stays as it chose it: columns, filter (but for the input itself), parameters, instants, outliers left out,
/// passes.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/core/log.hpp>
#include <wheelwright/core/warrant.hpp>
#include <wheelwright/filter/measurement.hpp>
#include <wheelwright/model/robot.hpp>
#include <wheelwright/study/hull_derivatives.hpp>

namespace wheelwright::study {

/// A commissioned robot and its filter: what an input changes.
struct RobotAt {
  Robot robot;
  FilterDesign filter;
};

/// One side of a prior, as an input moves it.
struct PriorRate {
  std::string parameter;                       ///< physical name
  double lower_left = 0.0, lower_right = 0.0;  ///< rates of the lower side, physical unit per unit of the input
  double upper_left = 0.0, upper_right = 0.0;  ///< of the upper side
};

/// An input by its name.
struct LocalInput {
  std::string name;
  std::string unit;
  double value = 0.0;
  std::optional<PriorRate> prior{};  ///< where it is a prior's: it moves sides only, and no row
};

/// The input `name` of `at`, whose model is `model`. Throws InvalidArgument where there is none, or it has no value.
[[nodiscard]] LocalInput local_input(const RobotAt& at, const Model& model, const std::string& name);

/// `at` with the input (not a prior's) at `x`. α follows β where the robot file gives none.
[[nodiscard]] RobotAt with_input(RobotAt at, const LocalInput& input, double x);

/// All inputs that `at` has a value for, priors left out.
[[nodiscard]] std::vector<std::string> robot_inputs(const RobotAt& at);

/// Options of local_derivatives().
struct LocalOptions {
  /// Names: declared.SENSOR (noise.SENSOR means the same: a recorded log does not change), filter.alpha, filter.beta,
  /// wheel_radius, track_width, encoder_counts_per_turn; prior.NAME.lower and prior.NAME.upper, and prior.NAME, the
  /// factor of its width as studies have it; NAME a physical parameter. Empty: all that the robot has a value for, and
  /// of the priors the declared ones and those that hold a bound.
  std::vector<std::string> inputs = {};
  double step = 1e-5;         ///< of the rows' differences, relative to the input, in (0, 0.01]
  double confidence = 0.999;  ///< CommissionOptions::confidence of the commissioning
};

/// The derivatives of one parameter's bounds with respect to one input; units of θ per unit of the input.
struct ParameterDerivative {
  OneSided lower;  ///< NaN where a side has none
  OneSided upper;
  OneSided width;                      ///< upper − lower
  bool differentiable = true;          ///< both bounds: left and right agree, to 1e-6
  std::optional<double> elasticity{};  ///< d ln width/d ln input, where differentiable and width and input are not 0
  std::string why_not{};               ///< in words, where not differentiable
};

/// One input.
struct LocalDerivative {
  std::string input;  ///< as it was asked for
  std::string unit;
  double value = 0.0;
  std::vector<ParameterDerivative> parameters;  ///< p, in the model's order
};

/// Result of local_derivatives().
struct LocalSensitivity {
  std::vector<std::string> parameters;  ///< names of θ
  std::vector<std::string> units;
  std::vector<double> lower, upper;     ///< the bounds themselves
  std::optional<HullOptima> optima{};   ///< what holds them; nothing where there are no derivatives
  std::vector<LocalDerivative> inputs;  ///< in the order asked for; none where there are no derivatives
  std::vector<std::string> notes;       ///< what is held fixed, and why there are none where there are none, for people
  core::Warrant warrant = core::Warrant::extrapolated;  ///< of the bounds
};

/// Derivatives of all bounds of `commissioning`, which was made from `log`. None (see notes) where its set is empty or
/// a union over open signs. Where noise is estimated, the rows' bounds are held fixed: the estimate's own dependence on
/// the input is not seen. Throws InvalidArgument, naming what was expected, for an input that is none or has no value.
[[nodiscard]] LocalSensitivity local_derivatives(LogSource& log, const Commissioning& commissioning,
                                                 const LocalOptions& options = {});

/// Where bounds are not differentiable, one sentence each: input, parameter, reason. None where all are.
[[nodiscard]] std::vector<std::string> not_differentiable(const LocalSensitivity& result);

}  // namespace wheelwright::study

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Derivatives of the parameters' bounds by changes of their rows, from the duals of the linear programs.
///
/// An upper bound is V = max { θ_j : a_i·θ <= b_i }. When rows depend on a number s, with rates a_i' and b_i', then
/// (envelope theorem; Gol'shtein 1972 and Freund 1985 where the optimum is degenerate)
///
///     V' = Σ_i λ_i (b_i' − a_i'·θ*)                          where θ* and λ are unique, and else to the right
///     V' = max over optimal θ of max { d_j : a_i·d <= b_i' − a_i'·θ for the rows i active at θ },
///
/// a linear program over few rows; to the left the same with all signs turned. Nothing here knows a robot.
///
/// Local sensitivity: derivatives of every bound by an input of the robot file at its present value, and the robot and
/// filter at neighbouring values.
///
/// The rows that hold a bound are smooth functions of an input; their multipliers turn the rows' rates into the
/// bound's, pass by pass of commissioning (bound_rates.hpp). No linear program over the log is solved again: per input
/// and pass, the log is walked twice, for all bounds at once. Everything that commissioning chose from the log stays as
/// it chose it: columns, filter (but for the input itself), parameters, instants, outliers left out, passes.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "bounds/polytope.hpp"
#include "core/log.hpp"
#include "core/regression.hpp"
#include "core/warrant.hpp"
#include "model/filter/measurement.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {
struct Commissioning;
}  // namespace wheelwright::commission

namespace wheelwright::study {

/// One-sided derivatives; NaN where there is none.
struct OneSided {
  double left = 0.0;
  double right = 0.0;
};

/// Optimal vertex of one bound of one parameter, and its active rows.
struct HullOptimum {
  std::size_t parameter = 0;                ///< j
  bounds::Side side = bounds::Side::upper;  ///< which bound of θ_j
  double value = 0.0;                       ///< the certified bound
  bool found = false;     ///< false: no vertex is known (a set that is flat to rounding); nothing below holds
  std::size_t block = 0;  ///< of Polytope::blocks()
  Eigen::VectorXd at;     ///< p, θ*: an optimal vertex, from its equations; the set's centre in other blocks
  /// The rows and prior sides that θ* meets with equality (to 1e-9 of the block's size), p coefficients each. The first
  /// `basis` of them define θ*; their multipliers >= 0 are a solution of Σ λ_i a_i = ±e_j, those of the others are 0.
  /// An upper bound moves by +λ_i per unit of b_i (for a row of the log: per unit of its bound dy), a lower bound by
  /// −λ_i.
  std::vector<bounds::WeightedRow> active;
  std::size_t basis = 0;
  bool unique_maximiser = true;  ///< all multipliers of the basis are > 0 (1e-9 of their scale): θ* is the only optimum
  /// True if just the basis is active and the maximiser is unique: then the bound has a derivative with respect to
  /// everything on which its rows depend smoothly.
  [[nodiscard]] bool is_regular() const { return found && unique_maximiser && active.size() == basis; }
};

/// All 2p bounds of a set.
struct HullOptima {
  Polytope set;
  Box prior;
  std::vector<HullOptimum> lower;  ///< p
  std::vector<HullOptimum> upper;  ///< p
};

/// The optima of all bounds of `set`, made of rows in the box `prior`. Active rows are sought among the facets and the
/// sides of the prior: rows that the set never needed are found by add_active_rows() only. Throws InvalidArgument
/// unless set and prior have the same dimension.
[[nodiscard]] HullOptima hull_optima(const Polytope& set, const Box& prior);

/// Walks `rows` once, and adds those that an optimum meets with equality and that its set could do without. `rows` are
/// those that the set was made of; the row numbers `excluded` (any order) are left out.
void add_active_rows(HullOptima& optima, core::RegressionSource& rows, std::vector<std::size_t> excluded = {});

/// Rates of an active row: a' and b'.
struct RowRate {
  Eigen::VectorXd a;  ///< p, or empty for zero
  double b = 0.0;
};

/// The derivative of a bound when its active rows move: with rates `right` where s grows, and `left` where it falls
/// (both per unit of growing s; the same where rows are smooth in s). One rate for each of optimum.active. Both sides
/// agree where the bound is regular, the rates are the same, and they couple no parameters that the rows keep apart
/// (the right one then is the largest over all values of these). NaN where no vertex was found, and where rows of a
/// bound that is not regular come to couple.
/// Throws InvalidArgument unless the numbers agree.
[[nodiscard]] OneSided bound_derivative(const HullOptima& optima, const HullOptimum& optimum,
                                        std::span<const RowRate> left, std::span<const RowRate> right);

/// Why an optimum is not regular, in words; empty where it is. `name` is the parameter's.
[[nodiscard]] std::string why_not_regular(const HullOptimum& optimum, const std::string& name);

/// "row 812 (t = 8.12 s)" or "the prior's upper side of parameter 2".
[[nodiscard]] std::string row_in_words(const bounds::RowOrigin& origin);

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
[[nodiscard]] LocalSensitivity local_derivatives(LogSource& log, const commission::Commissioning& commissioning,
                                                 const LocalOptions& options = {});

/// Where bounds are not differentiable, one sentence each: input, parameter, reason. None where all are.
[[nodiscard]] std::vector<std::string> not_differentiable(const LocalSensitivity& result);

}  // namespace wheelwright::study

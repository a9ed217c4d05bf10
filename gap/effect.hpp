// SPDX-License-Identifier: Apache-2.0
/// \file
/// An unmodelled effect as data: a user adds one by filling an Effect.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/core/interval.hpp>
#include <wheelwright/gap/drive.hpp>

namespace wheelwright {

/// A coefficient of an effect: what multiplies one of its columns.
struct EffectParameter {
  std::string name{};
  std::string unit{};
  int sign = 0;         ///< +1: physics wants >= 0; −1: <= 0; 0: either
  bool beside = false;  ///< comes along with the effect and is no measure of it (a changed inertia): not reported
};

/// A parameter on which an effect's columns depend nonlinearly.
struct ShapeParameter {
  std::string name{};
  std::string unit{};
  double lower = 0.0;        ///< in units of `scale`
  double upper = 0.0;        ///< likewise
  std::size_t scan = 1;      ///< points of the grid on which a search begins (on each side of zero)
  bool logarithmic = false;  ///< grid in equal ratios instead of equal steps
  bool both_signs = false;   ///< |value| is between the bounds, its sign either
  double resolution = 0.0;   ///< of a time: steps of the log below which stamps and holds of its makers are not known
  bool discrete = false;     ///< the grid's points are all values there are (a side, a kind): nothing lies between
  std::function<double(const Drive&)> scale{};  ///< of this drive, > 0 (a typical speed …); empty: 1
};

/// A physical quantity that an effect's coefficients and shapes stand for.
struct PhysicalValue {
  std::string name{};
  std::string unit{};
  double value = 0.0;
  double larger = 0.0;  ///< share by which it may be larger for what the model does not know
};

/// What an effect adds per unit of one of its parameters. Signals have one value per instant of the drive and are not
/// filtered yet; an empty signal stands for zeros.
struct Column {
  std::vector<Eigen::VectorXd> effort;       ///< per output: effort that the effect asks for in addition, (15)
  std::vector<Eigen::VectorXd> effort_rate;  ///< per output: signal whose time derivative is such an effort
  Eigen::VectorXd forward;                   ///< body velocity that the wheels do not show, m/s
  Eigen::VectorXd lateral;                   ///< likewise, to the left, m/s
  Eigen::VectorXd yaw;                       ///< likewise, rad/s
};

/// Whether an effect can be looked for on a drive at all.
struct Applicability {
  bool applies = true;
  std::string reason;  ///< what is missing, in words; empty where it applies
};

/// One unmodelled effect, or one parametric cause.
struct Effect {
  std::string name{};                         ///< as in results
  std::string sentence{};                     ///< what it is, for people
  std::string family{};                       ///< of effects that are the same cause; empty where it is alone
  std::string common{};                       ///< parametric cause that is a part of this effect: unequal gains have a
                                              ///< mean. Where both are found it is one cause; empty: none
  bool parametric = false;                    ///< moves θ or the kinematic scale of the base model
  std::vector<EffectParameter> parameters{};  ///< one for each column
  std::vector<ShapeParameter> shapes{};       ///< what the columns depend on besides
  bool unit_coefficient = false;  ///< the one column's coefficient is 1; `parameters` is empty, the shapes are
                                  ///< what is estimated
  double inexact = 0.0;  ///< share of what it takes off that its columns leave at best (impacts shorter than a sampling
                         ///< interval); an explanation with it may leave so much more
  std::string excite{};  ///< the manoeuvre that would show it
  std::function<Applicability(const Drive&)> applies{};  ///< empty: on every drive
  /// The columns at `shape` (one value for each of `shapes`), for a drive on which the effect applies and whose efforts
  /// are predicted (predict_efforts).
  std::function<std::vector<Column>(const Drive&, std::span<const double> shape)> columns{};
  /// What the coefficients (one for each of `parameters`) and shapes mean physically where they are not such quantities
  /// themselves, e.g. angle and direction of a slope; empty: they are.
  std::function<std::vector<PhysicalValue>(std::span<const double> coefficients, std::span<const double> shape)>
      physical{};
};

/// Throws InvalidArgument, naming the field, unless `effect` has a name and columns, its shapes have bounds in order
/// (> 0 where logarithmic) and at least one grid point, and a unit coefficient goes with no parameters.
void validate(const Effect& effect);

/// Whether `effect` can be looked for on `drive`.
[[nodiscard]] Applicability applicability(const Effect& effect, const Drive& drive);

/// All grid points of the effect's shapes on `drive`, the last one running fastest; one empty point for an effect without
/// shapes.
[[nodiscard]] std::vector<std::vector<double>> shape_grid(const Effect& effect, const Drive& drive);

/// Bounds of a shape on `drive`, in its unit: of its magnitude where it has both signs.
[[nodiscard]] Interval shape_bounds(const ShapeParameter& shape, const Drive& drive);

}  // namespace wheelwright

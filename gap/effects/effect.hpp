// SPDX-License-Identifier: Apache-2.0
/// \file
/// Unmodelled effects as data, helpers to build them, and the catalogue.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "core/interval.hpp"
#include "gap/rows/drive.hpp"

namespace wheelwright::gap {

/// A coefficient of an effect, the factor of one of its columns.
struct EffectParameter {
  std::string name{};
  std::string unit{};
  int sign = 0;         ///< +1: physically >= 0; −1: <= 0; 0: either
  bool beside = false;  ///< accompanies the effect and does not measure it (a changed inertia): not reported
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
  bool beside = false;  ///< of what surrounds the effect and not of itself (where the robot's friction is): neither
                        ///< reported nor counted as a number of its own
  std::function<double(const Drive&)> scale{};  ///< of this drive, > 0, e.g. a typical speed; empty: 1
};

/// Name of the physical value by which an effect says that the robot turns as one of another track: that track over the
/// robot file's, in 1.
inline constexpr std::string_view kTrackInEffect = "track_in_effect";

/// A physical quantity that an effect's coefficients and shapes stand for.
struct PhysicalValue {
  std::string name{};
  std::string unit{};
  double value = 0.0;
  double larger = 0.0;  ///< share by which it may be larger, for unknown properties of the robot
};

/// Column of an effect: its contribution per unit of one of its parameters. Signals have one value per instant of the
/// drive and are not filtered yet; an empty signal stands for zeros.
struct Column {
  std::vector<Eigen::VectorXd> effort;       ///< per output: additional effort that the effect needs, (15)
  std::vector<Eigen::VectorXd> effort_rate;  ///< per output: signal whose time derivative is such an effort
  Eigen::VectorXd forward;                   ///< body velocity that the wheels do not show, m/s
  Eigen::VectorXd lateral;                   ///< likewise, to the left, m/s
  Eigen::VectorXd yaw;                       ///< likewise, rad/s
};

/// Applicability of an effect to a drive, with the reason where it does not apply.
struct Applicability {
  bool applies = true;
  std::string reason;  ///< what is missing, in words; empty where it applies
};

/// A measurement without driving that tells an effect from others, the most telling first.
enum class DirectMeasurement {
  lengths,        ///< circumference of the wheels and track
  weight,         ///< scales under the wheels
  pull,           ///< force of the robot against a spring balance
  timing,         ///< motor current on the clock of the encoders
  turned_round,   ///< the same drive turned by half a turn
  lifted_wheels,  ///< driving with the wheels off the ground
  none,
};

/// One unmodelled effect, or one parametric cause. An effect that follows one of several laws, which have other columns
/// (friction that bends before it slides; slip as a speed or as a share of one), is several of the same name: at most
/// one of them is in a set of causes.
struct Effect {
  std::string name{};                     ///< as in results
  std::string noun{};                     ///< as sentences call it; empty: as catalogue_noun(name)
  std::string sentence{};                 ///< description for people
  std::string family{};                   ///< name shared by effects that are one cause to whoever mends it, each by a
                                          ///< law of its own; where a log leaves several of them standing they are one
                                          ///< answer. Empty: none
  std::vector<std::string> steady{};      ///< causes that it is when nothing changes in time: no rival of them
  std::string common{};                   ///< parametric cause that is a part of this effect: unequal gains have a
                                          ///< mean. Where both are found it is one cause; empty: none
  std::vector<std::string> stands_for{};  ///< effects that this one is together: a load off the middle adds mass and
                                          ///< shifts its centre. Where these do as well it is one cause
  bool parametric = false;                ///< moves θ or the kinematic scale of the base model
  bool as_built = false;                  ///< every robot has a little of it as it is built: on a log of the healthy
                                          ///< robot it is fitted though it would be no cause there
  std::vector<EffectParameter> parameters{};  ///< one for each column
  std::vector<ShapeParameter> shapes{};       ///< on which the columns depend nonlinearly
  bool unit_coefficient = false;  ///< the one column's coefficient is 1; `parameters` is empty, the shapes are
                                  ///< what is estimated
  double inexact = 0.0;  ///< share of its own contribution that its columns cannot explain (impacts shorter than a
                         ///< sampling interval); added to what an explanation with it may leave
  bool after_reversals = false;  ///< acts just after reversals of the torque, more sharply than its columns can
  bool above_band = false;       ///< it is the cause where the band above the filter's shows more just after them
  bool free_form = false;        ///< its columns span many laws: no robot file and no simulator has a number for each
  std::string excite{};          ///< the manoeuvre that would show it
  DirectMeasurement measured_by = DirectMeasurement::none;
  std::function<Applicability(const Drive&)> applies{};  ///< empty: on every drive
  /// The columns at `shape` (one value for each of `shapes`), for a drive on which the effect applies and whose efforts
  /// are predicted (predict_efforts).
  std::function<std::vector<Column>(const Drive&, std::span<const double> shape)> columns{};
  /// Physical quantities of the coefficients (one for each of `parameters`) and shapes, where these are not physical
  /// quantities themselves, e.g. angle and direction of a slope; empty: they are.
  std::function<std::vector<PhysicalValue>(std::span<const double> coefficients, std::span<const double> shape)>
      physical{};
};

/// Throws InvalidArgument, naming the field, unless `effect` has a name and columns, its shapes have bounds in order
/// (> 0 where logarithmic) and at least one grid point, and a unit coefficient goes with no parameters.
void validate(const Effect& effect);

/// Applicability of `effect` to `drive`.
[[nodiscard]] Applicability applicability(const Effect& effect, const Drive& drive);

/// All grid points of the effect's shapes on `drive`, the last one running fastest; one empty point for an effect
/// without shapes.
[[nodiscard]] std::vector<std::vector<double>> shape_grid(const Effect& effect, const Drive& drive);

/// Bounds of a shape on `drive`, in its unit: of its magnitude where it has both signs.
[[nodiscard]] Interval shape_bounds(const ShapeParameter& shape, const Drive& drive);

}  // namespace wheelwright::gap

namespace wheelwright::gap::catalogue {

/// Standard deviation of a signal.
[[nodiscard]] double deviation(const Eigen::VectorXd& signal);

/// sgn(signal), as tanh(signal/width).
[[nodiscard]] Eigen::VectorXd soft_sign(const Eigen::VectorXd& signal, double width);

/// Width for the sign of a joint's speed, rad/s: 0.6 % of the first joint's typical speed or 0.4 of a count.
[[nodiscard]] double sign_width(const Drive& drive);

/// Soft sign of the joint's smooth speed.
[[nodiscard]] Eigen::VectorXd speed_sign(const Drive& drive, std::size_t joint);

/// Typical speed of the joints (standard deviation of the first one's), rad/s; > 0.
[[nodiscard]] double typical_speed(const Drive& drive);

/// Typical effort of the joints (standard deviation of the first one's), > 0.
[[nodiscard]] double typical_effort(const Drive& drive);

/// `signal` through the lag T y' = signal − y, from y = signal at each segment's start.
[[nodiscard]] Eigen::VectorXd lagged(const Drive& drive, const Eigen::VectorXd& signal, double T);

/// `signal` followed no faster than `rate`, its unit per second, from each segment's start.
[[nodiscard]] Eigen::VectorXd followed(const Drive& drive, const Eigen::VectorXd& signal, double rate);

/// The column of additional efforts at the joints (empty ones stand for zeros): Model::input times them.
[[nodiscard]] Column at_joints(const Drive& drive, const std::vector<Eigen::VectorXd>& effort);

/// The column of the derivatives of such efforts.
[[nodiscard]] Column rate_at_joints(const Drive& drive, const std::vector<Eigen::VectorXd>& effort);

/// function(j) for every joint j.
template <typename Function>
[[nodiscard]] std::vector<Eigen::VectorXd> each_joint(const Drive& drive, const Function& function) {
  std::vector<Eigen::VectorXd> signals;
  for (std::size_t j = 0; j < drive.joints.size(); ++j) {
    signals.push_back(function(j));
  }
  return signals;
}

/// A signal at one joint, empty ones at the others.
[[nodiscard]] std::vector<Eigen::VectorXd> only(const Drive& drive, std::size_t joint, Eigen::VectorXd signal);

/// The column of a robot whose coordinates move faster than its joints show, by `speed` (one signal per coordinate,
/// empty for zeros): the base model's effort for that motion; for a robot on wheels also its body velocity. Of its
/// viscous friction the share `friction`, 0 to 1: friction in the joints knows nothing of what they do not show. Terms
/// of the base model that are functions of the motion are taken as they are.
[[nodiscard]] Column unseen_motion(const Drive& drive, const std::vector<Eigen::VectorXd>& speed, double friction);

/// The same for wheels whose rims move faster by `right` and `left`, m/s.
[[nodiscard]] Column unseen_rim_speeds(const Drive& drive, const Eigen::VectorXd& right, const Eigen::VectorXd& left,
                                       double friction);

/// The joints' efforts of the base model's inertial terms on the smooth motion, and of the share `friction` of its
/// viscous ones.
[[nodiscard]] std::vector<Eigen::VectorXd> inertial_efforts(const Drive& drive, double friction = 0.0);

/// Base regressor column of the parameter with the physical name `name`, per physical unit; zeros where the model has
/// none of this name. Terms that are functions of the motion are left out.
[[nodiscard]] Column base_column(const Drive& drive, std::string_view name);

/// a += b, signal by signal.
void add(Column& a, const Column& b);

/// The shape that chooses one of two joints: 0 or 1 (right, left).
[[nodiscard]] ShapeParameter side();

/// The shape of an effect of one wheel (0 right, 1 left) or of both with opposite signs (2).
[[nodiscard]] ShapeParameter side_or_opposite();

/// The shape that says which share of viscous friction acts on the body, by 1 (as the paper's model has it), one half
/// or 0 (all of it in the joints): lengths of the robot act on the torque by it, and a robot file does not say it.
[[nodiscard]] ShapeParameter friction_on_body();

/// The value of that shape in `shape` of `effect`; 1 for an effect without it.
[[nodiscard]] double friction_on_body(const Effect& effect, std::span<const double> shape);

/// The factors of the shape of one wheel or both, the first of `shape` (0 where there is none), at the right and the
/// left wheel.
[[nodiscard]] Eigen::Vector2d side_factors(std::span<const double> shape);

/// The signals of that shape: `right`, `left` or [right, −left]; empty where a wheel has none.
[[nodiscard]] std::vector<Eigen::VectorXd> on_side(double side, const Eigen::VectorXd& right,
                                                   const Eigen::VectorXd& left);

/// Applies where a robot has two driven wheels.
[[nodiscard]] Applicability needs_two_wheels(const Drive& drive);
/// Applies where a robot has two driven wheels and the log a heading.
[[nodiscard]] Applicability needs_heading(const Drive& drive);
/// Applies where the base model has no parameter of the physical name `name`, which would be the same column.
[[nodiscard]] Applicability needs_no(const Drive& drive, std::string_view name);

}  // namespace wheelwright::gap::catalogue

namespace wheelwright::gap {

/// All effects and parametric causes for a robot on two driven wheels. Coefficients are of effect_catalogue's units:
/// N·m at the wheel, m, rad, s, kg, relative changes; with current or voltage as effort, A or V stand for N·m.
///
/// Add to the vector, or take from it, as you like: nothing else knows what is in it.
[[nodiscard]] std::vector<Effect> effect_catalogue();

/// The same for the robot `model`: those with one joint have fewer effects, and one coefficient where wheels have two.
[[nodiscard]] std::vector<Effect> effect_catalogue(const Model& model);

/// The effect of that name, or null.
[[nodiscard]] const Effect* find_effect(const std::vector<Effect>& catalogue, std::string_view name);

/// Noun of the effect `name` in sentences: that of its law or of its entry in the catalogue; empty where there is
/// neither.
[[nodiscard]] std::string catalogue_noun(std::string_view name);

/// Noun of a family in sentences: "late torque"; its name as words for one that the catalogue does not have.
[[nodiscard]] std::string family_noun(std::string_view family);

/// Those that `own` lacks and whose law (effect_law.hpp) has terms for a robot of the model `model`: the terms on the
/// smooth motion are their columns, the law's parameters their coefficients and shapes.
[[nodiscard]] std::vector<Effect> effects_by_law(const Model& model, const std::vector<Effect>& own);

/// Dry, viscous, load-dependent and drifting friction, drag, scrub and casters.
[[nodiscard]] std::vector<Effect> friction_effects(std::size_t joints = 2);
/// Masses out of place, slopes, wheels out of round, wheels of other radius, tracks of other width, slip, payload.
[[nodiscard]] std::vector<Effect> geometry_effects(std::size_t joints = 2);
/// Gains, biases, lags, delays, clocks, dead zones, saturation, backlash, batteries.
[[nodiscard]] std::vector<Effect> actuator_effects(std::size_t joints = 2);

}  // namespace wheelwright::gap

namespace wheelwright {
using gap::Effect;
}  // namespace wheelwright

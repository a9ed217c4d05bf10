// SPDX-License-Identifier: Apache-2.0
/// \file
/// Robot description before the first drive: the robot file as a plain struct.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/interval.hpp"
#include "core/log.hpp"
#include "model/model.hpp"

namespace wheelwright::model {

/// Kind of the effort columns.
enum class EffortKind {
  torque,   ///< N·m at the wheel (N at a linear axis)
  current,  ///< A
  voltage,  ///< V
};

/// Name of the column that has efforts of this kind at `joint`.
[[nodiscard]] const std::string& effort_column(const Joint& joint, EffortKind kind);

/// Behaviour of the effort between two samples.
enum class Hold {
  zero_order,   ///< a command, constant from its time stamp to the next one
  first_order,  ///< measured, linear between samples
};

/// Where the delay and the smoothing of the efforts come from.
enum class EffortTimeOrigin {
  untold,    ///< the default: neither late nor early, which nobody declares
  declared,  ///< the robot file
  found,     ///< what a log shows, or leaves open
};

/// Time at which a held effort (Hold::zero_order) is replaced by the next one.
enum class EffortChanges {
  between,     ///< at an unknown moment between the stamps of the two
  at_samples,  ///< exactly at the stamp of the next one
};

/// Where logged wheel speeds come from.
enum class SpeedSource {
  automatic,           ///< found from the data
  encoder_difference,  ///< encoder counts differenced over a sampling interval: angles are rebuilt from them
  measured,            ///< samples of the speed itself
};

/// Low-pass filter of the wheel speeds, in the driver that logs them.
enum class SpeedFilterKind {
  exponential,  ///< y += (1 − e^{−h/T})(ω − y) with every row: a filter that runs at the rate of the log
  lag,          ///< T ẏ + y = ω: one that runs much faster than the log
  mean,         ///< mean of the speeds in the rows of the last T, the newest included
};

/// Word of the robot file: "exponential", "lag", "mean".
[[nodiscard]] std::string_view to_string(SpeedFilterKind kind);

/// Filter that wheel speeds passed through before they were logged, while efforts did not. What is linear stays an
/// equation when both its sides pass through it: efforts are filtered alike.
struct SpeedFilter {
  SpeedFilterKind kind = SpeedFilterKind::exponential;
  int order = 1;       ///< 1, or 2 such filters in a row (exponential)
  Interval time{};     ///< s, holds T > 0
  bool found = false;  ///< by a log, not declared

  /// The value that is reckoned with: the middle.
  [[nodiscard]] double middle() const { return 0.5 * (time.lower + time.upper); }
  friend bool operator==(const SpeedFilter& a, const SpeedFilter& b) = default;
};

/// Speeds that a driver cut off to whole multiples of a unit, instead of rounding them: each stands for the middle of
/// what it may have been, except 0 between two signs.
struct SpeedCut {
  double unit = 0.0;  ///< rad/s or m/s, > 0
  bool down = false;  ///< down instead of towards zero
  friend bool operator==(const SpeedCut& a, const SpeedCut& b) = default;
};

/// What a logged pose is.
enum class PoseSource {
  automatic,    ///< a measurement of its own, unless it agrees with the wheels as only wheel odometry does
  independent,  ///< a measurement of its own, also where an encoder's counts are too coarse to show it
};

/// A bound |n| <= value on the noise of a sensor, or the wish that it be estimated from the log.
struct NoiseBound {
  std::optional<double> value;  ///< unit of the column; nothing means "estimate"
  /// Whatever happened before, the mean of an error is within ±bias; nothing: anything up to the bound, for ever.
  std::optional<double> bias{};
  double correlation = 0.0;  ///< s, from which on errors know nothing of each other; read where there is a bias
  /// Root of an error's mean square about its mean, whatever happened before; read where there is a bias.
  std::optional<double> deviation{};
};

/// Declared noise of the sensors. A bound that is not declared is estimated.
struct SensorNoise {
  NoiseBound wheel_speed;  ///< rad/s
  NoiseBound wheel_angle;  ///< rad
  NoiseBound effort;       ///< unit of the effort
  NoiseBound position;     ///< m (pose, or the single axis's own position, m or rad)
  NoiseBound heading;      ///< rad
  NoiseBound gyro;         ///< rad/s, of gyro_z
};

/// Filter constants of (24); what is not given is chosen from the data.
struct FilterWish {
  std::optional<int> order;     ///< 1 (the paper's) or 2
  std::optional<double> alpha;  ///< 1/s; equal to beta where it is not given
  std::optional<double> beta;   ///< 1/s
};

/// Constants of the motors, which make physical quantities of current or voltage. Gear ratio: motor turns per wheel
/// turn.
struct Motor {
  std::optional<double> torque_constant;  ///< N·m/A at the motor shaft
  std::optional<double> resistance;       ///< Ω
  std::optional<double> back_emf;         ///< V·s/rad at the motor shaft
  double gear_ratio = 1.0;                ///< –
};

/// An effect beyond the basic model that the robot is known to have (effect_law.hpp says which there are).
struct RobotEffect {
  std::string name;                            ///< e.g. "stribeck"
  std::map<std::string, Interval> parameters;  ///< what is known of each; lower = upper for a single value

  /// The value that a simulator takes: the mid-point. Throws InvalidArgument where there is no such parameter.
  [[nodiscard]] double value(const std::string& parameter) const;
  friend bool operator==(const RobotEffect& a, const RobotEffect& b);
};

/// A robot as its file describes it. Names of parameters are those of Model::parameters' `physical` names.
struct Robot {
  std::string name = "robot";
  std::string model = "differential_drive";  ///< differential_drive | single_axis
  double wheel_radius = 0.0;                 ///< r, m (differential drive)
  double track_width = 0.0;                  ///< D, m (differential drive)
  std::optional<double>
      footprint_radius;               ///< m, of the circle about the wheels' midpoint that holds all of the robot's
                                      ///< mass: I <= m R² (differential drive)
  bool lever_arm_is_track = false;    ///< ℓ = D, the paper's convention, instead of D/2
  bool anisotropic_friction = false;  ///< five parameters (f1 ≠ f2) instead of four
  EffortKind effort = EffortKind::torque;
  Hold hold = Hold::first_order;
  EffortChanges effort_changes = EffortChanges::between;  ///< of a held effort
  Interval effort_delay{0.0, 0.0};      ///< s, holds the constant time by which logged efforts are late (< 0: early)
  Interval effort_smoothing{0.0, 0.0};  ///< s, holds T of y += (1 − e^{−h/T})(u − y), as efforts are logged
  EffortTimeOrigin effort_time_origin = EffortTimeOrigin::untold;  ///< of effort_delay and effort_smoothing
  bool effort_unsigned = false;                                    ///< only |effort| was logged
  std::map<std::string, double> nominal;                           ///< physical parameter -> value as designed
  std::map<std::string, Interval> prior;                           ///< physical parameter -> bounds known beforehand
  std::optional<std::vector<std::string>> parameters;  ///< requested parameters; nothing means the model's choice
  SensorNoise noise;
  FilterWish filter;
  std::optional<double> encoder_counts_per_turn;
  std::optional<EvenClock> clock;  ///< of the sensors that sample evenly behind scattered stamps (step 0: the stamps
                                   ///< hold); nothing: as the log shows
  SpeedSource speed_source = SpeedSource::automatic;
  std::optional<SpeedFilter> speed_filter{};  ///< nothing: speeds are not smoothed
  std::optional<SpeedCut> speed_cut{};        ///< nothing: speeds are not cut off
  PoseSource pose_source = PoseSource::automatic;
  double heading_offset = 0.0;  ///< rad, counterclockwise from the logged heading to the driving direction; readers of
                                ///< logs add it to `theta`
  bool wheel_directions_checked = false;  ///< somebody saw both wheels count up, efforts > 0, as the robot drives ahead
  std::map<std::string, double> limits;   ///< effort, speed, acceleration
  std::optional<double> kinematic_window;      ///< s, of the kinematic residual (odometry_filter.hpp)
  std::map<std::string, double> thresholds{};  ///< output -> constant threshold μ_o of (39), unit of the output, >= 0
  std::optional<Motor> motor;
  std::vector<RobotEffect> effects;  ///< beyond the basic model, each name once
};

/// The model of `robot` with the parameters that it requests (those it names in `parameters`, else the model's
/// basic set) and those of its effects; geometry and effort map are those of the effects too (effect_law.hpp,
/// effect_law.hpp). The order: basic parameters, those of effects, optional ones. Throws InvalidArgument when the
/// robot's geometry, its requests or its effects make no sense.
[[nodiscard]] Model make_model(const Robot& robot);

/// Physical names of all parameters that a robot of this kind can have, the basic ones first: dry friction (`coulomb`)
/// and, for a single axis, a constant `offset` are there on request. What its effects bring comes beside these; dry
/// friction is none of them where an effect has it for each wheel. Throws InvalidArgument as make_model.
[[nodiscard]] std::vector<std::string> possible_parameters(const Robot& robot);

/// Effort at the wheel per unit of torque: 1 where efforts are torques, 1/(N k_t) for currents, R/(N k_t) for voltages;
/// nothing where the motor's constants are not known. Throws InvalidArgument for constants that are not > 0.
[[nodiscard]] std::optional<double> effort_per_torque(const Robot& robot);

/// Prior box of θ_L in the order of `model.parameters`: the robot's own prior where it has one (for a parameter of an
/// effect, effect_prior), else the model's wide physical default.
struct PriorBox {
  std::vector<Interval> bounds;  ///< p intervals, units of θ_L
  std::vector<bool> declared;    ///< whether the bound came from the robot file
};
[[nodiscard]] PriorBox prior_box(const Robot& robot, const Model& model);

/// True if the robot drives on a right and a left wheel beside each other, and so has wheel radius and track width, a
/// heading and a pose (Model::on_two_wheels); else it is an axis.
[[nodiscard]] bool on_two_wheels(const Robot& robot);

/// The robot with `errors` (of interpolated columns) added to the noise bounds that it declares, the largest of each
/// kind; an estimated bound sees them in the log itself.
[[nodiscard]] Robot with_column_errors(Robot robot, const std::vector<core::ColumnError>& errors);

}  // namespace wheelwright::model

namespace wheelwright {
using model::Hold;
using model::Robot;
}  // namespace wheelwright

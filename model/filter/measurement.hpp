// SPDX-License-Identifier: Apache-2.0
/// \file
/// Measurement of a robot by a log (columns, kind of motion signal, behaviour between samples), and the constants of
/// the torque filter.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/log.hpp"
#include "model/filter/effort_correction.hpp"
#include "model/model.hpp"
#include "model/robot.hpp"

namespace wheelwright::filter {

/// f(t) = α e^{−βt} (24) for order 1; f₂ = f * f = α² t e^{−βt} for order 2, which works on wheel angles.
struct FilterDesign {
  int order = 2;         ///< 1 (the paper's) or 2
  double alpha = 20.0;   ///< α, 1/s
  double beta = 20.0;    ///< β, 1/s
  double settle = 12.0;  ///< order 2 on angles: rows before settle/β from the start of a segment are dropped (unless it
                         ///< begins at standstill), since they hold the error of the first angle difference with weight
                         ///< α² t e^{−βt}; 12 leaves 7e-5 of it

  /// Gain at frequency zero: (α/β)^order.
  [[nodiscard]] double static_gain() const;
  /// Time by which slow signals are delayed, s: order/β.
  [[nodiscard]] double delay() const;
};

/// Throws InvalidArgument, naming the field, unless order is 1 or 2, α and β are finite and > 0, and settle >= 0.
void validate(const FilterDesign& design);

/// Kind of the motion columns.
enum class MotionKind {
  angle,       ///< joint angle at the time stamp
  mean_speed,  ///< encoder counts over a sampling interval, divided by it, stamped in its middle: the angles at the
               ///< interval's ends are exact to half a count, for ever
  speed,       ///< samples of the speed; linear between samples
};

/// Everything the filter needs to know of a log's columns. Part of a commissioned model: a detector reads the same way.
struct Measurement {
  MotionKind motion = MotionKind::speed;
  std::vector<std::string> motion_columns;  ///< one for each joint
  std::vector<std::string> effort_columns;  ///< one for each joint
  std::string heading_column;               ///< empty where the heading is odometry
  Hold hold = Hold::first_order;            ///< of the effort
  bool effort_unsigned = false;             ///< the sign of an effort is taken from its joint's direction of motion
  double count = 0.0;                       ///< mean_speed: speeds are whole multiples of this, rad/s (0: not rounded)
  double nominal_step = 0.0;                ///< median step of the log it was found on, s
  double shortest_step = 0.0;               ///< one in a hundred steps of that log was shorter, s (0: not known)
  double unused_count = 0.0;  ///< speed: what `count` would be if the declared bound of the speeds did not stand above
                              ///< it, rad/s (0: nothing was found)

  std::optional<model::SpeedCut> cut{};  ///< speed: half of its unit is given back

  EffortCorrection correction{};  ///< of the efforts, before anything else is made of them
  model::EffortChanges changes =
      model::EffortChanges::between;  ///< what an effort may do between two samples, beside `hold`
  Interval delay{0.0, 0.0};           ///< s, holds the constant time by which logged efforts are late
  Interval smoothing{0.0, 0.0};       ///< s, holds the time constant of the filter that efforts passed through
                                      ///< (Robot::effort_smoothing), which is undone: sharpening()
  double clock_drift = 0.0;           ///< bound of the relative error of the times between samples (core::EvenClock)

  /// A longer step between two samples is a hole in the log: nothing is known of the effort in it, s; 0 where no step
  /// is known. 1.75 nominal steps, for steps that vary less: as long as two of the shortest together, but at least 1.35
  /// nominal steps; for mean speeds, whose interval is one step, 1.05 of these.
  [[nodiscard]] double longest_step() const;

  /// κ = 1/(e^{h/T} − 1) over `smoothing`, at the nominal step h: the effort of row k was y_k + κ(y_k − y_{k−1}).
  [[nodiscard]] Interval sharpening() const;

  /// By how much a bound on the error of the effort of joint `j` grows from the logged value to the one that acted.
  [[nodiscard]] double effort_gain(std::size_t j) const {
    return correction.gain_of(j) * (1.0 + 2.0 * sharpening().upper);
  }

  /// Columns in the order in which RegressorFilter wants a sample: motion, effort, heading where there is one.
  [[nodiscard]] std::vector<std::string> columns() const;
};

/// `speed` with half of the unit given back that it was cut off by; as it is where there is no `cut`, and at 0 between
/// two signs.
[[nodiscard]] double uncut(double speed, const std::optional<model::SpeedCut>& cut);

/// Finds how `log` measures `robot`: angles where the log has them, else speeds; for order 2 and speed_source automatic
/// the log is searched for count-differenced speeds (encoder.hpp). What is merely found never replaces what is
/// declared: where the robot file bounds the noise of the wheel speeds by half of the quantum found or more, and
/// neither gives encoder_counts_per_turn nor asks for speed_source encoder_difference, the speeds are samples with that
/// bound. Efforts are corrected for the robot's effects. Walks the log once. Throws InputError when a joint has no
/// usable motion or effort column (naming the columns that were looked for), InvalidArgument when order 1 is asked of a
/// log that has angles only.
[[nodiscard]] Measurement find_measurement(LogSource& log, const Robot& robot, const Model& model, int order);

}  // namespace wheelwright::filter

namespace wheelwright {
using filter::FilterDesign;
using filter::Measurement;
using filter::MotionKind;
}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// A whole log in memory for a gap analysis: evenly sampled, raw and smoothed; and its filter f₂ = f * f of (24) with α
/// = β, on whole signals.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "core/log.hpp"
#include "model/filter/measurement.hpp"
#include "model/model.hpp"
#include "model/robot.hpp"

namespace wheelwright::gap {

/// Rows of a Drive that have a property.
using Mask = Eigen::Array<bool, Eigen::Dynamic, 1>;

/// One joint (a wheel, or the axis of a single_axis robot); for a linear axis read m for rad. All have one value per
/// instant of the drive.
struct JointSignals {
  Eigen::VectorXd speed;                ///< as measured, whole counts where the encoder is known, rad/s
  Eigen::VectorXd smooth_speed;         ///< rad/s
  Eigen::VectorXd smooth_acceleration;  ///< rad/s²
  Eigen::VectorXd angle;                ///< measured, or the integral of the speed from 0 at each segment's start, rad
  Eigen::VectorXd effort;               ///< at the instants; a held command: mean of what was held before and after
  Eigen::VectorXd held_effort;          ///< held from its instant to the next one; empty where efforts are not held
  Eigen::VectorXd smooth_effort;        ///< smoothed `effort`
  Eigen::VectorXd effort_noise;         ///< noise as large as the measured effort's, draw_effort_noise(); empty: none
  Eigen::VectorXd predicted_effort;     ///< of the base model on the smooth motion; empty before predict_efforts()
  Eigen::VectorXd expected_effort;      ///< predicted_effort, or with what causes add to it (expect_efforts)
  Mask resting;                         ///< stands still
};

/// One motion coordinate of the model (v1, v2).
struct CoordinateSignals {
  Eigen::VectorXd speed;                ///< from the joints' measured speeds
  Eigen::VectorXd smooth_speed;         ///< from the joints' smooth speeds
  Eigen::VectorXd smooth_acceleration;  ///< from the joints' smooth accelerations
};

/// One log off-line. Instants are evenly spaced inside a segment.
struct Drive {
  Model model;
  double wheel_radius = 0.0;                ///< r, m (0 for other than wheeled robots)
  double track_width = 0.0;                 ///< D, m (likewise)
  double lever_arm = 0.0;                   ///< ℓ of the difference channel, m (likewise)
  double step = 0.0;                        ///< h, s
  double count = 0.0;                       ///< quantum of the speeds, rad/s (0: none known)
  bool has_efforts = true;                  ///< else all efforts are zeros: only the pose can be compared
  bool efforts_unsigned = false;            ///< the log has their size only: they have their joint's sign of motion
  bool efforts_flowed = false;              ///< they are currents, so what the actuators had, whatever was commanded
  bool angles_measured = false;             ///< else a joint's angle begins anew, at 0, in each segment
  std::size_t window = 0;                   ///< samples of the smoothing window, odd
  Eigen::VectorXd t;                        ///< s, the log's own, ascending
  std::vector<std::size_t> segment_starts;  ///< ascending, begins with 0
  std::vector<JointSignals> joints;
  std::vector<CoordinateSignals> coordinates;
  Eigen::VectorXd heading;         ///< of the pose, rad, unwrapped; empty where the log has none
  Eigen::VectorXd x, y;            ///< of the pose, m; empty where the log has none
  Eigen::VectorXd gyro;            ///< yaw rate, rad/s; empty where the log has none
  Eigen::VectorXd theta;           ///< θ_L of the base model that predict_efforts() was given; empty before
  std::size_t resampled = 0;       ///< rows of segments whose steps differed from the median by more than 1 %
  std::size_t moved_segments = 0;  ///< segments that began before the one before ended, moved to follow it
  std::size_t dropped = 0;         ///< rows of segments with fewer than three samples

  /// Number of instants.
  [[nodiscard]] Eigen::Index rows() const { return t.size(); }
  /// True if the log has a position and a heading.
  [[nodiscard]] bool has_pose() const { return heading.size() > 0 && x.size() > 0; }
  /// True if the log has a heading.
  [[nodiscard]] bool has_heading() const { return heading.size() > 0; }
  /// True if it is a robot on two driven wheels, with torques (in whatever unit) of both.
  [[nodiscard]] bool two_wheels() const { return wheel_radius > 0.0 && track_width > 0.0 && joints.size() == 2; }
  /// Half-open rows [first, last) of segment `k`.
  [[nodiscard]] std::pair<Eigen::Index, Eigen::Index> segment(std::size_t k) const;
  /// The physical parameter `name` (Parameter::physical) of the base model `theta`; 0 where the model has none of this
  /// name or `theta` is not known yet.
  [[nodiscard]] double physical(std::string_view name) const;
};

/// Options of make_drive().
struct DriveOptions {
  double smoothing_window = 0.06;  ///< s; at least five samples are taken
  double shortest_rest = 0.1;      ///< s a joint must stand still to be `resting`
};

/// The drive of `log`, as `measurement` says that it measures `robot`; the model is make_model(robot).
///
/// - Mean speeds are rounded to whole counts (Measurement::count). Angles become mean speeds between neighbouring
///   samples, at the middle of the interval, where all other columns are then means too: one instant less per segment.
/// - A segment whose steps differ by more than 1 % from the log's median step is resampled linearly at that step.
/// - Smooth signals are those of a local quadratic over `smoothing_window` (Savitzky and Golay 1964), fitted
///   one-sidedly at the ends of a segment and never across them.
/// - Unsigned efforts take the sign of their joint's motion.
/// - A joint stands still where its smooth speed stays below `count`, four standard deviations of its noise or
///   1 % of its root mean square, whichever is largest, for `shortest_rest`. One of whose encoder a count a step is
///   faster than 20 % of its root mean square does where its angle stays within one count for `shortest_rest`, or for
///   as long as makes a count slower than 5 %.
///
/// Throws InvalidArgument when `log` lacks a column of `measurement` or has no segment of three samples.
[[nodiscard]] Drive make_drive(const LogTable& log, const Robot& robot, const Measurement& measurement,
                               const DriveOptions& options = {});

/// The drive whose measured efforts have their JointSignals::effort_noise once more: what differs in anything made of
/// both is what noise does to it.
[[nodiscard]] Drive with_effort_noise(const Drive& drive);

/// Sets `theta` and the joints' predicted efforts: Y(v, v̇) θ of the smooth motion (20), mapped back to the joints by
/// the inverse of Model::input. Throws InvalidArgument unless θ has p entries and the input matrix is square and
/// regular.
void predict_efforts(Drive& drive, const Eigen::VectorXd& theta);

/// The measured heading where there is one; else that of odometry, from 0 at each segment's start (trapezoidal, as
/// RegressorFilter's); zeros for a model without a heading.
[[nodiscard]] Eigen::VectorXd heading_or_odometry(const Drive& drive);

/// Value and first derivative (per step) of the quadratic fitted to `window` samples about each sample, one-sidedly at
/// the ends, in place of `value` and `slope`. `window` must be odd; signals shorter than it take the largest odd window
/// that fits, and fewer than three samples are returned as they are with slope 0. Savitzky and Golay (1964).
void smooth_quadratic(std::span<const double> signal, std::size_t window, std::span<double> value,
                      std::span<double> slope);

/// f₂ * u for u linear between instants, β² t e^{−βt} (static gain 1), exact; begins at zero at each segment.
/// `beta` > 0, 1/s. Throws InvalidArgument unless `signal` has one value per instant.
[[nodiscard]] Eigen::VectorXd filtered(const Drive& drive, double beta, const Eigen::VectorXd& signal);

/// f₂ * u̇ for the same u: no derivative is taken.
[[nodiscard]] Eigen::VectorXd filtered_rate(const Drive& drive, double beta, const Eigen::VectorXd& signal);

/// f₂ * τ: Model::input · efforts as the log holds them (held or linear), one signal per output.
[[nodiscard]] std::vector<Eigen::VectorXd> filtered_outputs(const Drive& drive, double beta);

/// The base regressor f₂ * Y, [parameter][output]; an empty vector stands for a signal of zeros. RegressorFilter (order
/// 2, α = β) weighs the same motion by means of f₂, so that the rows differ by (βh)² in relation; for angles its
/// instants are half a step later.
[[nodiscard]] std::vector<std::vector<Eigen::VectorXd>> filtered_regressor(const Drive& drive, double beta);

/// Rows after `memory`/β from the start of their segment, whose filter has forgotten what was before.
[[nodiscard]] Mask settled(const Drive& drive, double beta, double memory = 10.0);

/// Rows for which no joint's filtered indicator of rest exceeds `share`: with stiction the torque of a resting joint
/// is any number, and no model of motion says anything about it. None for a drive without efforts.
[[nodiscard]] Mask moving(const Drive& drive, double beta, double share = 0.02);

/// Why few rows of `drive` are settled() and moving(), and what to do: "of 900 rows …; drive longer".
[[nodiscard]] std::string why_few_rows(const Drive& drive, double beta);

/// The rows that `use` marks among every so many that are about `row_step`/β apart, from the first row on.
[[nodiscard]] std::vector<Eigen::Index> rows_apart(const Drive& drive, const Mask& use, double row_step, double beta);

}  // namespace wheelwright::gap

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Reference motion of a drive for which margins are computed, and the rows of a healthy robot along it.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "core/log.hpp"
#include "core/regression.hpp"
#include "model/filter/regressor_filter.hpp"

namespace wheelwright::detector {

/// The motion of a drive at the instants of the filter (the samples; for angles and mean speeds the ends of the steps
/// between them, with the means over these steps). What follows from it is about every robot whose drive, read by these
/// sensors, may look just so; efforts of the log it was read from play no part.
struct ReferenceMotion {
  std::vector<std::size_t> sample;      ///< K rows of the log
  std::vector<double> t;                ///< K times of these rows, s
  std::vector<double> instant;          ///< K times of the instants, s
  std::vector<double> step;             ///< K lengths of the steps that end there, s (speeds: 0 for a segment's first)
  std::vector<double> weights;          ///< K: RegressorFilter::share() there; empty: 1, no step is unknown
  std::vector<bool> cuts;               ///< K: RegressorFilter::cut() there; empty: none
  MotionKind kind = MotionKind::speed;  ///< what the motion was read from
  double nominal_step = 0.0;            ///< of the measurement, s
  Eigen::MatrixXd speed;                ///< coordinates × K, v
  Eigen::MatrixXd joint_speed;          ///< joints × K
  Eigen::MatrixXd joint_angle;          ///< joints × K, integral of joint_speed over the segment
  std::vector<double> heading;          ///< K, rad
  std::vector<bool> settled;            ///< K: whether a detector decides at this instant, whatever the noise
  std::vector<std::size_t> segment_starts;  ///< ascending instants at which a segment begins
  RegressionBlock rows;                     ///< K instants: Y_f of the motion, with the bounds dY, dy of the sensors
  filter::SignalErrors errors;              ///< of the filter
  bool measured = false;   ///< rows and signals have the sensors' errors already; a planned motion has none
  core::RowMatrix any_dY;  ///< dY, and dy, of any log that these sensors may write of the drive: what bounds the
  Eigen::VectorXd any_dy;  ///< motion between samples is read from efforts and speeds that are noisy themselves
  core::RowMatrix
      between_dY;  ///< of any_dY what motion may do between samples: it grows with the efforts; empty: nothing
  Eigen::VectorXd between_dy;  ///< of any_dy what efforts may do between samples, alike
  double most_effort = 0.0;    ///< three times the efforts that the rows can be due to, for every θ of the set
  core::RowMatrix
      effort_dY;  ///< by how much between_dY grows for each unit that every output's effort is larger by, up to
                  ///< most_effort; functions of the motion left out
  core::RowMatrix
      effort_doubt;  ///< of functions of the motion: what they may be beside Y and dY where efforts are larger by up to
                     ///< most_effort (a speed whose sign is in doubt then)
  Eigen::VectorXd largest;       ///< sup |θ_j| over the set of the filter's MotionBound; empty where it has none
  std::size_t effort_reach = 0;  ///< steps in which an effort's sample counts for dy; 0: efforts are known

  /// Number of instants K.
  [[nodiscard]] std::size_t instants() const { return t.size(); }
  /// By how much the steps that end at instants k and k + 1 count for what happens between them, s: all of the second
  /// for speeds, half of each for angles.
  [[nodiscard]] std::array<double, 2> shares(std::size_t k) const {
    const double half = 0.5 * step[k + 1];
    return {kind == MotionKind::speed ? half : 0.5 * step[k], half};
  }
  /// With what share of its weight rows hold what happens between instants k and k + 1.
  [[nodiscard]] double held(std::size_t k) const { return k + 1 < weights.size() ? weights[k + 1] : 1.0; }
  /// With what share of its weight rows hold a jump of the motion that the sample of instant k is the first to show:
  /// for speeds that of the step that ends there.
  [[nodiscard]] double held_jump(std::size_t k) const {
    return kind != MotionKind::speed ? held(k) : weights.empty() ? 1.0 : weights[k];
  }
  /// Whether the weights of all that was before instant k end there.
  [[nodiscard]] bool cut_at(std::size_t k) const { return k + 1 < cuts.size() && cuts[k + 1]; }
};

/// The motion of `log` as `filter` reads it, whose error bounds the rows get. Walks the log (three times where efforts
/// bound the motion between samples) and holds it. Throws InvalidArgument when the log lacks a column of the filter's
/// measurement.
[[nodiscard]] ReferenceMotion read_reference(LogSource& log, const RegressorFilter& filter);

}  // namespace wheelwright::detector

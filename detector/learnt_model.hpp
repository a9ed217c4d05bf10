// SPDX-License-Identifier: Apache-2.0
/// \file
/// Learnt model: the numbers of a commissioned model that a detector needs.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "bounds/box.hpp"
#include "bounds/slab_rows.hpp"
#include "core/warrant.hpp"
#include "detector/events.hpp"
#include "model/filter/error_class.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/noise.hpp"
#include "model/filter/odometry_measurement.hpp"
#include "model/model.hpp"
#include "model/robot.hpp"

namespace wheelwright::detector {

/// Constant threshold μ_o of one output, and what driving that was held out says of it.
struct ConstantThreshold {
  double value = 0.0;        ///< μ_o, unit of the output, >= 0
  bool stated = false;       ///< by the robot file; else the largest |ε| of all blocks
  std::size_t held_out = 0;  ///< blocks on which a threshold was tried: of the others (stated: this one, on all)
  std::size_t exceeded = 0;  ///< of these, with |ε| above it
  double chance = 1.0;       ///< that so many or more exceed it if blocks can be exchanged; stated: 1
};

/// Constant thresholds μ_o of (39), found by experiment (commission/constant_thresholds.hpp) or stated. **Without
/// guarantee.** For an output whose threshold was found the promise is: a further block of driving exceeds it with a
/// probability of at most 1/(blocks + 1), if it can be exchanged with those of the log (the same robot, ground and kind
/// of driving) and θ̂ of the whole log predicts no worse than one that lacks a block.
struct ConstantThresholds {
  double block = 0.0;        ///< s, length of a block; 0 where all thresholds are stated and the log has no blocks
  std::size_t blocks = 0;    ///< number of blocks of the log
  std::size_t learning = 0;  ///< blocks of whose maxima the thresholds that were tried are the largest
  std::vector<ConstantThreshold> outputs{};

  /// μ_o.
  [[nodiscard]] Eigen::VectorXd mu() const;
  /// Probability of a false alarm in a block, in any output whose threshold was found; nothing where some are stated.
  [[nodiscard]] std::optional<double> false_alarms() const;
  /// True if more of the blocks that were held out exceeded their threshold than the promise lets expect, at 1 % over
  /// all outputs.
  [[nodiscard]] bool refuted() const;
};

/// Parameter set of one residual, learnt from a fault-free log, and its alarm rule.
struct LearntSet {
  Eigen::VectorXd estimate{};  ///< θ̂; for a parameter that the log does not excite, the Chebyshev centre's value
  std::vector<bounds::HalfSpace> facets{};  ///< of the feasible set, p coefficients each
  Box box{};                                ///< finite box that bounds the set (the certified hull)
  Persistence persistence{};
  core::Warrant warrant = core::Warrant::extrapolated;  ///< of set, hull and thresholds
  std::optional<ConstantThresholds> constant{};         ///< of D2; nothing where the log is too short to find them
};

/// What is assumed of a pose's errors. Those of x, y and heading at one instant may depend on each other in any way.
struct PoseErrors {
  filter::ErrorClass position{};  ///< of x and of y, m
  filter::ErrorClass heading{};   ///< rad
  double shortest_step = 0.0;     ///< s, between poses

  /// True if some of them average out.
  [[nodiscard]] bool average() const { return position.bias < position.bound || heading.bias < heading.bound; }
};

/// What a detector of the kinematic residual at a stated risk needs (pose_sums.hpp).
struct PoseRiskModel {
  double risk = 1e-9;                                 ///< that the set lacks the true parameters
  core::Warrant warrant = core::Warrant::guaranteed;  ///< of set and thresholds, the risk aside
  PoseErrors errors{};
  std::vector<bounds::HalfSpace> facets{};
  Box box{};
  std::vector<double> scales{};      ///< s, of the sums
  double delay = 0.0;                ///< s, by which their weights foresee
  Eigen::MatrixXd usual_position{};  ///< weights × scales: variance of a sum's errors of position on the learnt log
  Eigen::MatrixXd usual_heading{};   ///< the same of errors of heading
};

/// The channel of the kinematic residual. The estimate is one of OdometryMeasurement::parameters().
struct KinematicModel : LearntSet {
  filter::OdometryMeasurement measurement{};
  double window = 1.0;                     ///< W, s
  filter::OdometryErrors errors{};         ///< of the rows of driving to come
  std::optional<PoseRiskModel> at_risk{};  ///< where the robot file declares errors of the pose that average out
};

/// What a detector at a stated risk needs (scale_detector.hpp).
struct RiskModel {
  double risk = 1e-9;                                 ///< that the set lacks the true θ
  core::Warrant warrant = core::Warrant::guaranteed;  ///< extrapolated where the errors were estimated from the log
  filter::ErrorClasses errors{};                      ///< what is assumed of the sensors' errors
  std::vector<bounds::HalfSpace> facets{};
  Box box{};
  std::vector<double> scales{};  ///< s, of the sums
  double delay = 0.0;            ///< s, by which their weights foresee
  Eigen::MatrixXd usual{};       ///< weights × scales: variance of a sum's errors on the log that was learnt from
};

/// A commissioned robot as it is watched: the channel of the torque residual (the estimate is θ̂_L), and that of the
/// kinematic residual where the log had a pose or a gyro.
struct OnlineModel : LearntSet {
  Robot robot{};
  Model model{};
  Measurement measurement{};
  FilterDesign filter{};
  filter::SignalErrors errors{};  ///< dY and dy of the rows, ē included
  std::optional<KinematicModel> kinematic{};
  std::optional<RiskModel> at_risk{};           ///< where the robot file declares errors that average out
  std::vector<core::Assumption> assumptions{};  ///< behind the numbers, with the verdict of the log on each
};

/// The share of the stated rate of false alarms that sums of the torque residual may use: half of it where sums of the
/// kinematic residual are watched beside them, else all.
[[nodiscard]] double torque_share(const OnlineModel& model);

/// Names and units of the outputs as a Model that has nothing else, for tables and charts.
[[nodiscard]] Model kinematic_outputs(const KinematicModel& model);

}  // namespace wheelwright::detector

namespace wheelwright {
using detector::OnlineModel;
}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Commissioning of the kinematic residual: effective wheel radii and yaw gains with bounds, from the pose or gyro of a
/// fault-free log.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "bounds/feasible_set.hpp"
#include "commission/output_noise.hpp"
#include "commission/survey.hpp"
#include "commission/validation.hpp"
#include "core/log.hpp"
#include "detector/learnt_model.hpp"
#include "identify/least_squares.hpp"
#include "model/filter/odometry_measurement.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {

/// Result of commissioning for one kinematic parameter.
struct KinematicParameter {
  std::string name;
  std::string unit;
  identify::Excitation excitation = identify::Excitation::identified;
  std::string reason;              ///< why it is not identified, for people
  std::optional<double> estimate;  ///< least squares; nothing where the log does not show the parameter
  std::optional<double> standard_error;
  double lower = 0.0;  ///< bounds (certified hull)
  double upper = 0.0;
  double nominal = 0.0;                                 ///< of the robot file's geometry; 0 for a bias
  core::Warrant warrant = core::Warrant::extrapolated;  ///< of lower and upper
};

/// What proves the set at a stated risk (pose_at_risk.hpp).
struct PoseRiskProof {
  std::vector<bounds::CertifiedBound> lower, upper;  ///< of each parameter; rows are those of pose_sum_rows()
  double learning = 0.0;                             ///< share of the log of which V0 is learnt
};

/// Result of commission_kinematics().
struct KinematicCommissioning {
  /// What became of it.
  enum class Status {
    done,     ///< a model came out
    partial,  ///< a model came out; the bounds of some parameters are those of the prior
    absent,   ///< the log or the robot has nothing to compare wheel odometry with (a pose that repeats the wheels is
              ///< nothing, see pose_origin.hpp): no model
    nothing,  ///< too little driving, or no parameters in the prior box explain it: no model
  };
  Status status = Status::absent;
  std::string message;                            ///< one sentence for people
  std::optional<detector::KinematicModel> model;  ///< where the status gives one
  std::vector<KinematicParameter> parameters;
  std::vector<bounds::CertifiedBound> lower, upper;  ///< of each of them: the windows that prove it (FeasibleSet)
  PoseRiskProof at_risk;                             ///< where `model` has something at a stated risk
  std::vector<OutputNoise> noise;            ///< one for each output; a declared bound is the largest of the log's rows
  std::vector<OutputValidation> validation;  ///< on held-out blocks, of a model made from the other blocks
  Box prior;
  std::vector<std::string> far_from_nominal;  ///< parameters whose side of the prior box was moved outward to hold θ̂
  std::size_t rows = 0;                       ///< that the set is made of
  bool declared_too_small = false;  ///< no parameters explain the log within the declared noise, or the pose or gyro
                                    ///< comes at another time than the wheels: the noise was estimated
  std::optional<double> delay;      ///< s, by which pose or gyro are later than the wheels, where noise is declared and
                                    ///< the log tells one; negative: earlier
  double raise = 1.0;               ///< an estimated bound was raised by this, so that the prior box explains the log
};

/// Options of commission_kinematics().
struct KinematicCommissionOptions {
  double window = 1.0;  ///< W, s, > 0; a robot's own stands above it
  FoldOptions folds;    ///< purge is set to the window
  identify::ExtrapolationOptions extrapolation;
  detector::Persistence persistence;
  double radius_share = 0.3;  ///< prior box of radii and yaw gains: nominal ± this share, inside (0, 1); moved outward
                              ///< where least squares leaves it, which the message says
  double bias = 0.2;          ///< prior box of the gyro's bias: ± this, rad/s
};

/// Log → rows of OdometryFilter → least squares, feasible set, validation, as commission_robot() does it for the
/// torque. `measurement` (nothing: absent) is what find_odometry says, `survey` is that of the log.
///
/// Noise: where position and heading (the latter suffices for the output yaw) and the motion (noise_budget.hpp) are
/// declared, bounds are the sensors', derived as OdometryFilter states, with the largest acceleration that the log
/// shows for what happens between samples; of the gyro, where its noise and `limits: acceleration` are declared.
/// Elsewhere ē is extrapolated from the residuals. Where nothing explains the log within the declared noise (wheels
/// slip a little in every turn, the pose's point is off the axle), or a pose or gyro is late or early against the
/// wheels (PoseTiming::told), all outputs fall back to the extrapolated bound, and the message says so. Of speeds in
/// whole multiples of a unit (speed_unit.hpp) of which neither the robot file nor the log says that they were cut off,
/// the intervals hold the parameters of both readings; the model is that of rounded ones. Throws InvalidArgument for
/// options out of range.
[[nodiscard]] KinematicCommissioning commission_kinematics(
    LogSource& log, const Robot& robot, const std::optional<filter::OdometryMeasurement>& measurement,
    const Survey& survey, const KinematicCommissionOptions& options = {});

}  // namespace wheelwright::commission

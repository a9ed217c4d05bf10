// SPDX-License-Identifier: Apache-2.0
/// \file
/// Measurement of the kinematic residual: the columns of motion and pose of a log, and the bounds on their errors.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/log.hpp"
#include "model/filter/measurement.hpp"
#include "model/robot.hpp"

namespace wheelwright::filter {

/// Columns of motion and pose of a log, and the settings of the kinematic residual. Part of a commissioned model.
struct OdometryMeasurement {
  MotionKind motion = MotionKind::speed;    ///< mean speeds are integrated back to the angles behind them
  std::vector<std::string> motion_columns;  ///< right wheel, left wheel
  bool position = false;                    ///< columns x, y, theta: outputs longitudinal and lateral
  bool heading = false;                     ///< column theta: output yaw; true where `position` is
  bool gyro = false;                        ///< column gyro_z: output gyro_yaw
  bool held_pose = false;     ///< a slower sensor's pose is repeated: only rows with a new one count as poses
  double count = 0.0;         ///< mean_speed: speeds are whole multiples of this, rad/s (0: not rounded)
  double nominal_step = 0.0;  ///< median step of the log it was found on, s
  std::optional<model::SpeedCut> cut{};  ///< speed: half of its unit is given back

  /// Columns in the order in which OdometryFilter wants a sample.
  [[nodiscard]] std::vector<std::string> columns() const;
  /// Names of the outputs that there are, of longitudinal, lateral, yaw, gyro_yaw in this order.
  [[nodiscard]] std::vector<std::string> outputs() const;
  /// Their units, m or rad.
  [[nodiscard]] std::vector<std::string> output_units() const;
  /// Names of the parameters that there are, of radius_right, radius_left, yaw_gain_right, yaw_gain_left, gyro_bias.
  [[nodiscard]] std::vector<std::string> parameters() const;
  /// Their units: m, m, rad of heading per rad of wheel (written 1), rad/s.
  [[nodiscard]] std::vector<std::string> parameter_units() const;
};

/// Bounds on the sensors' errors, from which the rows' are derived; 0 means exact.
struct OdometryErrors {
  double motion = 0.0;        ///< n_φ (rad) for angles and mean speeds, n_ω (rad/s) for speeds
  double position = 0.0;      ///< n_p of x and of y, m
  double heading = 0.0;       ///< n_θ, rad
  double gyro = 0.0;          ///< n_g of gyro_z, its bias apart, rad/s
  double acceleration = 0.0;  ///< |ω̇| of each wheel between samples is at most this, rad/s²
  double yaw_gain = 0.0;      ///< both yaw gains are at most this: |θ̈| <= 2·yaw_gain·acceleration
  /// For each output, or empty: a value > 0 is ē, which holds everything that the row may be wrong by and stands in the
  /// place of all bounds above: dy = ē, dY = 0.
  Eigen::VectorXd estimated{};
};

/// Measurement of `log` for a kinematic residual of `robot`; nothing where the robot is no differential drive, or the
/// log has neither the columns theta (with x and y or without) nor gyro_z. Angles are used where the log has them, else
/// speeds in the way that `torque` (how the torque residual reads the log) found them. A pose is taken as held where it
/// stays exactly the same over a fifth or more of the steps in which a wheel moves. Walks the log once where it has a
/// pose.
[[nodiscard]] std::optional<OdometryMeasurement> find_odometry(LogSource& log, const Robot& robot, const Model& model,
                                                               const Measurement& torque);

}  // namespace wheelwright::filter

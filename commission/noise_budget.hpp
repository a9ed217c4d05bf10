// SPDX-License-Identifier: Apache-2.0
/// \file
/// Which errors of the rows stand on declared sensor bounds, and which must be estimated.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/filter/measurement.hpp>
#include <wheelwright/filter/noise.hpp>
#include <wheelwright/model/model.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// The declared part of the noise.
struct NoiseBudget {
  bool complete = false;  ///< motion and effort are both declared: the rows' bounds need no estimate
  SensorErrors sensors;   ///< all zero unless complete
};

/// For complete declarations: half a count for count-differenced speeds and encoder angles, else the declared bound of
/// the motion column; the declared bound of the effort. What happens between samples is no noise: SignalErrors::motion.
/// Otherwise the equation error as a whole is estimated from the residuals: it then holds the noise of all sensors, and adding
/// propagated bounds to it would count them twice.
[[nodiscard]] NoiseBudget noise_budget(const Robot& robot, const Measurement& measurement);

/// `limit` of each joint (acceleration_limit) as one of each coordinate of `model`.
[[nodiscard]] Eigen::VectorXd coordinate_limit(const Model& model, const std::vector<double>& joint_limit);

/// Bound on the error of the motion column alone, where the robot file or the encoder tells it: rad for angles and mean
/// speeds, rad/s for speeds.
[[nodiscard]] std::optional<double> motion_error(const Robot& robot, const Measurement& measurement);

}  // namespace wheelwright

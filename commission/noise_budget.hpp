// SPDX-License-Identifier: Apache-2.0
/// \file
/// Which errors of the rows stand on declared sensor bounds, and which must be estimated.
#pragma once

#include <optional>

#include <wheelwright/commission/survey.hpp>
#include <wheelwright/filter/measurement.hpp>
#include <wheelwright/filter/noise.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// The declared part of the noise.
struct NoiseBudget {
  bool complete = false;  ///< motion and effort are both declared: the rows' bounds need no estimate
  SensorErrors sensors;   ///< all zero unless complete
};

/// For complete declarations: half a count for count-differenced speeds and encoder angles, else the declared bound of
/// the motion column, plus what interpolation may add (survey.hpp); the declared bound of the effort. Otherwise the
/// equation error as a whole is estimated from the residuals: it then holds the noise of all sensors, and adding
/// propagated bounds to it would count them twice.
[[nodiscard]] NoiseBudget noise_budget(const Robot& robot, const Measurement& measurement, const Survey& survey);

/// Bound on the error of the motion column alone, where the robot file or the encoder tells it: rad for angles and mean
/// speeds, rad/s for speeds.
[[nodiscard]] std::optional<double> motion_error(const Robot& robot, const Measurement& measurement);

}  // namespace wheelwright

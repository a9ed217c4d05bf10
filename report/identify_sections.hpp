// SPDX-License-Identifier: Apache-2.0
/// \file
/// The parts of an identification's page. All functions return HTML; empty where the result has nothing of the kind.
#pragma once

#include <string>

#include <wheelwright/inference/identification.hpp>
#include <wheelwright/report/time_axis.hpp>

namespace wheelwright::report {

/// Estimates by all estimators and intervals by all methods, one line each; what each promises; the test.
[[nodiscard]] std::string comparison_section(const Identification& result);

/// Rank and condition, directions that are not seen with their manoeuvres, combinations that are known best.
[[nodiscard]] std::string identifiability_section(const Identification& result);

/// Which seconds carry which parameter.
[[nodiscard]] std::string information_section(const Identification& result, const TimeAxis& axis);

/// Weights and worst episodes of the robust fit, active physical constraints.
[[nodiscard]] std::string robust_section(const Identification& result, const TimeAxis& axis);

/// Delay, lags and Stribeck speed, in words and with their curves.
[[nodiscard]] std::string shapes_section(const Identification& result);

/// Wheel radii and track width from the pose.
[[nodiscard]] std::string kinematics_section(const Identification& result);

/// Noise of each column, known or found.
[[nodiscard]] std::string column_noise_section(const Identification& result);

}  // namespace wheelwright::report

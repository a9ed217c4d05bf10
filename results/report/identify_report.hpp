// SPDX-License-Identifier: Apache-2.0
/// \file
/// The page of an identification, its sections (HTML; empty where the result has nothing of the kind) and its drawings
/// as SVG.
#pragma once

#include <string>
#include <vector>

#include "commission/identification.hpp"
#include "results/report/page.hpp"

namespace wheelwright::report {

/// One row of bars for each parameter (`names`, text): the share of its information in each window of the log, the
/// fewest windows that carry most of it filled. Over log time; over windows in their order where the log's time goes
/// back. Empty without windows or where no parameter has information.
[[nodiscard]] std::string information_bars(const inference::InformationOverTime& information,
                                           const std::vector<std::string>& names, const TimeAxis& axis);

/// The residual with a shape held at each value over the residual without it, the best one marked; empty for fewer than
/// two points.
[[nodiscard]] std::string shape_curve(const commission::ShapeFinding& shape);

/// Estimates by all estimators and intervals by all methods, one line each; what each promises; the test.
[[nodiscard]] std::string comparison_section(const commission::Identification& result);

/// Rank and condition, directions that are not seen with their manoeuvres, combinations that are known best.
[[nodiscard]] std::string identifiability_section(const commission::Identification& result);

/// Information about each parameter over time.
[[nodiscard]] std::string information_section(const commission::Identification& result, const TimeAxis& axis);

/// Weights and worst episodes of the robust fit, active physical constraints.
[[nodiscard]] std::string robust_section(const commission::Identification& result, const TimeAxis& axis);

/// Delay, lags and Stribeck speed, in words and with their curves.
[[nodiscard]] std::string shapes_section(const commission::Identification& result);

/// Wheel radii and track width from the pose.
[[nodiscard]] std::string kinematics_section(const commission::Identification& result);

/// Noise of each column, known or found.
[[nodiscard]] std::string column_noise_section(const commission::Identification& result);

/// One self-contained HTML page: what was found in words, what to do next, estimators and intervals side by side with
/// what each promises, what the log can and cannot tell, which seconds tell it, robust and constrained fits, delay,
/// lags and Stribeck speed with their curves, kinematics, noise, raw signals, data.
[[nodiscard]] std::string identify_report(const commission::Identification& result, const ReportContext& context);

}  // namespace wheelwright::report

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Where in the operating space a fault shows best: drive there to check the robot.
#pragma once

#include <vector>

#include <Eigen/Core>

#include <wheelwright/detector/fault_margin.hpp>
#include <wheelwright/detector/fault_rows.hpp>
#include <wheelwright/detector/fault_type.hpp>
#include <wheelwright/filter/noise.hpp>

namespace wheelwright {

/// A plane of operating points: two coordinates' speeds at no acceleration, or their accelerations while passing through
/// the speeds `at`.
struct OperatingPlane {
  bool accelerations = false;  ///< the axes are accelerations
  std::vector<double> x;       ///< of the first coordinate, m/s or m/s²
  std::vector<double> y;       ///< of the second one, rad/s or rad/s²; a single value for models with one coordinate
  Eigen::VectorXd at{};        ///< speeds, one for each coordinate, where the axes are accelerations
};

/// Smallest certain magnitude of a fault on one side at each point, x.size() × y.size(); infinite where none is certain.
struct OperatingMap {
  OperatingPlane plane;
  Eigen::MatrixXd smallest;
};

/// The map of `fault` for a detector with thresholds `rule` whose rows have the errors `errors`, once the filter has
/// settled at each point (settled_rows()). Throws InvalidArgument for empty axes.
[[nodiscard]] OperatingMap operating_map(const FaultType& fault, double side, const Model& model,
                                         const FilterDesign& design, const SignalErrors& errors,
                                         const ThresholdRule& rule, OperatingPlane plane);

}  // namespace wheelwright

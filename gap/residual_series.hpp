// SPDX-License-Identifier: Apache-2.0
/// \file
/// Residuals of each stage of a gap analysis as signals in time, for locate_gap() and for reports.
#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

namespace wheelwright::gap {

/// Equation that a residual belongs to.
enum class GapSpace {
  dynamic,    ///< filtered efforts against the model
  kinematic,  ///< increments of the pose against wheel odometry
};

/// Residuals of one channel on the rows that the analysis used. All have one value per row.
struct ResidualSeries {
  GapSpace space = GapSpace::dynamic;
  std::string channel;       ///< "sum", "difference"; "forward", "lateral", "yaw"
  std::string unit;          ///< of the values
  Eigen::VectorXd t;         ///< s, the log's own time; kinematic rows: the middle of the window
  Eigen::VectorXd signal;    ///< the left side: filtered effort, or increment of the pose
  Eigen::VectorXd nominal;   ///< left by M0 with its nominal θ (of the robot file or the baseline)
  Eigen::VectorXd refitted;  ///< left by M0 with θ fitted again: the structural part and the noise
  Eigen::VectorXd after;     ///< left by the best combination of causes
  double floor = 0.0;        ///< standard deviation of the noise, unit of the values
};

}  // namespace wheelwright::gap

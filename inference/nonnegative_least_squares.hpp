// SPDX-License-Identifier: Apache-2.0
/// \file
/// Least squares with coefficients >= 0, for a handful of columns.
#pragma once

#include <Eigen/Core>

namespace wheelwright {

/// argmin ‖Ex − f‖ subject to x >= 0, by Lawson and Hanson's active set (1974, algorithm NNLS 23.10); E has few columns
/// and may have dependent ones. Entries that are not positive are exactly 0, and the columns of positive entries are
/// linearly independent. Columns should be of like size. Throws InvalidArgument where shapes disagree or a number is
/// not finite.
[[nodiscard]] Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& E, const Eigen::VectorXd& f);

}  // namespace wheelwright

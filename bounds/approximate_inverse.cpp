// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/approximate_inverse.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/LU>

#include <wheelwright/core/interval.hpp>

namespace wheelwright {

ApproximateInverse approximate_inverse(const Eigen::MatrixXd& matrix) {
  const auto point = [](double x) { return Interval{x, x}; };
  ApproximateInverse result{matrix.partialPivLu().inverse(), std::numeric_limits<double>::infinity()};
  if (!result.inverse.allFinite()) {
    return result;
  }
  double squares = 0.0;
  for (Eigen::Index i = 0; i < matrix.rows(); ++i) {
    for (Eigen::Index k = 0; k < matrix.cols(); ++k) {
      Interval rest = point(i == k ? 1.0 : 0.0);
      for (Eigen::Index j = 0; j < matrix.rows(); ++j) {
        rest = rest - point(result.inverse(i, j)) * point(matrix(j, k));
      }
      if (!std::isfinite(rest.lower) || !std::isfinite(rest.upper)) {
        return result;
      }
      const double largest = std::max(std::abs(rest.lower), std::abs(rest.upper));
      squares = round_up(squares + round_up(largest * largest));
    }
  }
  result.defect = round_up(std::sqrt(squares));
  return result;
}

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
#include "bounds/box.hpp"

#include "core/linear_algebra.hpp"

namespace wheelwright::bounds {

Coordinates whitened(const Box& box, const Eigen::MatrixXd& information) {
  check_finite(box, "box of coordinates");
  const auto p = static_cast<Eigen::Index>(box.dimension());
  Eigen::MatrixXd full = information;
  for (Eigen::Index j = 0; j < p; ++j) {
    const double half = 0.5 * box.sides[static_cast<std::size_t>(j)].width();
    full(j, j) += 1.0 / std::max(half * half, 1e-280);
  }
  const Eigen::VectorXd scale = full.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlation = scale.asDiagonal() * full * scale.asDiagonal();
  const core::EigenPairs eigen = core::symmetric_eigen(correlation);
  const Eigen::VectorXd roots = eigen.values.cwiseMax(1e-14).cwiseSqrt().cwiseInverse();
  const std::vector<double> centre = box.centre();
  return {Eigen::Map<const Eigen::VectorXd>(centre.data(), p), scale.asDiagonal() * eigen.vectors * roots.asDiagonal()};
}

Eigen::VectorXd extent(const Box& box, const Coordinates& coordinates) {
  const auto p = static_cast<Eigen::Index>(box.dimension());
  Eigen::VectorXd farthest(p);
  for (Eigen::Index j = 0; j < p; ++j) {
    const Interval& side = box.sides[static_cast<std::size_t>(j)];
    const double centre = coordinates.centre[j];
    farthest[j] = std::max(std::abs(side.upper - centre), std::abs(side.lower - centre));
  }
  return core::inverse(coordinates.transform).cwiseAbs() * farthest;
}

}  // namespace wheelwright::bounds

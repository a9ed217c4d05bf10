// SPDX-License-Identifier: Apache-2.0
/// \file
/// Shift in time between a pose or gyro and the wheels.
#pragma once

#include <cstddef>
#include <optional>

#include <Eigen/Core>

#include "core/regression.hpp"

namespace wheelwright::commission {

/// By how much a pose or a gyro is later than the wheels.
struct PoseTiming {
  double delay = 0.0;           ///< s; negative: earlier
  double standard_error = 0.0;  ///< s, valid under autocorrelated residuals
  double freedom = 0.0;         ///< degrees of freedom of its Student's t

  /// True where the shift is more than interpolation between samples `step` s apart makes, and more than chance but for
  /// kRiskOfDoubt: declared noise does not bound the pose's rows then. Wheels that slip in proportion to the
  /// acceleration look the same.
  [[nodiscard]] bool told(double step) const;
};

/// The shift that explains `rows` of OdometryFilter best, to the first order and together with their parameters: a pose
/// that is λ late shows y(t) = Y(t − λ)θ ≈ Yθ − λẎθ, with the slope Ẏθ of central differences over 0.1 s (and a `step`
/// at least) to either side, where no instant is missing. `theta` (p): the parameters by which the slope is taken;
/// `weights`: one for each output. It is told by the turning alone: of the first outputs, `positions` of them, the
/// direction of motion is the pose's own, as late as what it is compared with. Nothing where fewer than kFewestInstants
/// instants have a slope, or it shows nothing of its own.
[[nodiscard]] std::optional<PoseTiming> pose_timing(const core::RegressionBlock& rows, const Eigen::VectorXd& theta,
                                                    const Eigen::VectorXd& weights, double step, std::size_t positions);

}  // namespace wheelwright::commission

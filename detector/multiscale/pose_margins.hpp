// SPDX-License-Identifier: Apache-2.0
/// \file
/// Detectability along a drive in the pose at a stated risk: the smallest faults that the sums of what odometry leaves
/// of it show (pose_sums.hpp).
///
/// Over the steps j after its onset a fault adds to a sum
///
///     κ Σ K_j g_jᵀ (E_j q_j r/2 + s_j (E_j a_1 + E_j⊥ d) h_j),
///     κ Σ K_j g_j (c_R q_R,j − c_L q_L,j + s_j a_2 h_j)         of headings,
///
/// q_j what the wheels roll beyond what their encoders show in a healthy robot (OdometryFaultRows), and what the
/// encoders show beyond it stands in the regressor: the polynomial of FaultRow, solved exactly for every ϑ of the set
/// at a stated risk and all errors within the sum's radius. g_j turns with the robot, and so a fault that turns it
/// leaves gᵀE as it is, but for what the filter of g lags behind. Weights, and the radius, are **those of the log**:
/// those of another drive alike differ by what its errors make of them, which no size here allows for. A fault that
/// changes what encoders show changes the weights that are made of it, too: of such a fault those alone are spoken of
/// that are made of headings.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "core/log.hpp"
#include "core/regression.hpp"
#include "detector/faults/margins.hpp"
#include "detector/multiscale/pose_sums.hpp"
#include "detector/multiscale/sum_margins.hpp"

namespace wheelwright::detector {

/// A drive as the sums of its pose see it.
struct PoseSumDrive {
  /// A look at a sum.
  struct Look {
    std::size_t step = 0;  ///< the newest one in it
    std::size_t weight = 0, scale = 0;
    double radius = 0.0;  ///< of what errors can do
    double width = 0.0;   ///< of the set: max yϑ − min yϑ
  };
  std::vector<PoseWeight> weights;
  std::vector<double> scales;                  ///< s
  double miss = 0.0;                           ///< probability that the set or the errors at one look are not within
                                               ///< their bounds
  std::vector<PoseSumDetector::Step> steps;    ///< from pose to pose
  std::vector<std::size_t> segment_starts;     ///< of `steps`: the first ones after a restart
  Eigen::MatrixXd g;                           ///< (2 · weights) × steps
  std::vector<Look> looks;                     ///< in the order of time
  core::RowMatrix y;                           ///< looks × p
  std::array<double, 2> radius{}, yaw_gain{};  ///< at most

  /// When a step ends, s.
  [[nodiscard]] double end(std::size_t step) const { return steps[step].begin + steps[step].h; }
};

/// Walks up to `most` s of `log` through the PoseSumDetector of `model`, whose false alarms are `false_alarms` a
/// second. Throws InvalidArgument where `model` has nothing at a stated risk, or the log lacks a column.
[[nodiscard]] PoseSumDrive read_pose_drive(LogSource& log, const KinematicModel& model, double false_alarms,
                                           double most = 600.0);

/// As margins_at_risk(), of the faults that leave a trace in a pose, for onsets at the times `onsets` (s, ascending).
[[nodiscard]] std::vector<FaultMargins> pose_margins_at_risk(const PoseSumDrive& drive, const KinematicModel& model,
                                                             const Model& robot, std::span<const FaultType> faults,
                                                             std::span<const double> onsets,
                                                             const SumMarginOptions& options = {});

}  // namespace wheelwright::detector

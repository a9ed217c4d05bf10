// SPDX-License-Identifier: Apache-2.0
/// \file
/// What a commissioning says of the kinematic residual at a stated risk, and the log's own word on the assumption.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "commission/commission.hpp"
#include "core/regression.hpp"
#include "detector/multiscale/pose_sums.hpp"

namespace wheelwright::commission {

/// Id of the assumption (core::Assumption) behind what is said of a pose at a risk.
inline constexpr const char* kPoseNoiseAverages = "pose_noise_averages";

/// Options of pose_at_risk().
struct PoseAtRiskOptions {
  double risk = 1e-9;                                                 ///< that the set lacks the true parameters
  std::vector<double> scales{0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0};  ///< s, of the sums
  double learning = 0.1;    ///< share of the log at its beginning of which V0 is learnt; the set's sums leave it out
  double test_risk = 2e-3;  ///< probability that a log which keeps to the assumption is said to contradict it
};

/// What is assumed of the errors of a robot's pose; nothing where its file declares no bias, or not both bounds.
/// `shortest_step`: s, between poses.
[[nodiscard]] std::optional<detector::PoseErrors> pose_errors(const Robot& robot, double shortest_step);

/// The half-spaces of which the set at a risk is the intersection, as rows |y − Yϑ| <= dy over the box of the
/// `guaranteed` model: first its facets, whose other side is that box, then the sums over scales of 1 s and more at all
/// looks after the learning, in the order of time, as far as they cut the box; RegressionBlock::sample numbers them,
/// facets first. Of `risk` the risk of all looks together, which is spread over the time driven in `log`, errors,
/// scales and delay are used; V0 is learnt of the share `learning` of the log. Walks it four times.
[[nodiscard]] RegressionBlock pose_sum_rows(LogSource& log, const detector::KinematicModel& guaranteed,
                                            const detector::PoseRiskModel& risk, double learning);

/// Set, thresholds and verdict.
struct PoseAtRisk {
  std::optional<detector::PoseRiskModel> model;  ///< where the log does not contradict the assumption
  PoseRiskProof proof;                           ///< of its set
  core::AssumptionVerdict verdict = core::AssumptionVerdict::not_tested;
  std::string detail;  ///< why there is no model, for people; empty where there is
};

/// The set of the `guaranteed` model cut by sums (pose_sum_rows()) with all their risks together
/// PoseAtRiskOptions::risk; V0 of later driving; and the test: the log contradicts the assumption where no parameters
/// are left, where a sum stands outside, or where sums spread wider than such errors make them, time and again.
/// `seconds`: of the log.
[[nodiscard]] PoseAtRisk pose_at_risk(LogSource& log, const detector::KinematicModel& guaranteed,
                                      const detector::PoseErrors& errors, double seconds,
                                      const PoseAtRiskOptions& options = {});

/// What a commissioning says of the kinematic residual alone.
struct KinematicPart {
  KinematicCommissioning residual;
  std::optional<PoseAtRisk> at_risk;  ///< nothing where nothing is asked
};

/// The same that commission_robot() makes of it, as far as no other part of the result decides (whether there is a
/// model, and what warrants it). Throws as that.
[[nodiscard]] KinematicPart make_kinematic_part(LogSource& log, const Robot& robot, const CommissionOptions& options);

/// Adds KinematicModel::at_risk to a guaranteed result whose robot file declares errors of the pose that average out,
/// and the assumption with the log's verdict. Where the log contradicts it nothing is said, and a note says why.
/// `made`: what pose_at_risk() said before.
void learn_pose_at_risk(LogSource& log, Commissioning& result, const PoseAtRiskOptions& options = {},
                        const std::optional<PoseAtRisk>& made = {});

/// Shortest step between poses of `log`, and the median one, s; 0 where there are none.
struct PoseSteps {
  double shortest = 0.0, median = 0.0;
};
[[nodiscard]] PoseSteps pose_steps(LogSource& log, const filter::OdometryMeasurement& measurement);

}  // namespace wheelwright::commission

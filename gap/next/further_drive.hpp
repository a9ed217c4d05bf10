// SPDX-License-Identifier: Apache-2.0
/// \file
/// Planned drives of a robot whose log was analysed: within what limits, and what they would tell.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "commission/design/plan.hpp"
#include "commission/design/subject.hpp"
#include "gap/causes/candidate.hpp"
#include "gap/causes/confusion.hpp"
#include "gap/prepared.hpp"
#include "gap/rows/block_gram.hpp"
#include "gap/rows/drive.hpp"
#include "model/robot.hpp"

namespace wheelwright::gap {

/// The drive along `plan` without noise: speeds and accelerations are the plan's own, smooth signals are the same exact
/// ones, efforts those of the base model at the subject's θ° (inverse dynamics (20)), linear between instants, the pose
/// the plan's. Wheels that are planned to stand still for 0.1 s rest. Throws InvalidArgument for a plan of fewer than
/// three samples, or one of another number of coordinates than the model.
[[nodiscard]] Drive planned_drive(const design::Plan& plan, const design::DesignSubject& subject);

/// The robot with `theta`, for planning; without a measurement where the log has no efforts.
[[nodiscard]] design::DesignSubject subject_of(const PreparedGap& prepared, const Robot& robot,
                                               const Eigen::VectorXd& theta);

/// Limits of the robot file; speed and acceleration that it lacks are the largest of the log, 80 % of an effort limit
/// are planned with, the space is what the log's path took (at least 0.5 m about the start), the duration a third of
/// the log's within 20 and 60 s.
[[nodiscard]] design::MotionLimits limits_within(const PreparedGap& prepared, const Robot& robot);

/// Fills ConfusablePair::inseparable and reason. The signatures `on_log` (signatures() of `table`) are looked at on a
/// few random manoeuvres within limits_within(), without noise and with the log's channels. Where on all of them the
/// columns of the one are sums of columns of the other, it is a special case of it. A pair is inseparable where on all
/// of them either one explains the other but for 10⁻³ of its sum of squares. Else the log did not excite what tells the
/// two apart. Nothing is filled where no motion is within the limits.
void judge_pairs(std::vector<ConfusablePair>& pairs, const CandidateTable& table,
                 const std::vector<std::optional<Signature>>& on_log, BaseModel base, const PreparedGap& prepared,
                 const Robot& robot, const BlockOptions& blocks);

}  // namespace wheelwright::gap

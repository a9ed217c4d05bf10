// SPDX-License-Identifier: Apache-2.0
/// \file
/// Another drive of a robot whose log was analysed: within what limits, and what it would tell.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/design/limits.hpp>
#include <wheelwright/design/subject.hpp>
#include <wheelwright/gap/block_gram.hpp>
#include <wheelwright/gap/candidate.hpp>
#include <wheelwright/gap/confusion.hpp>
#include <wheelwright/gap/diagnosis.hpp>
#include <wheelwright/gap/prepared.hpp>
#include <wheelwright/model/robot.hpp>

namespace wheelwright {

/// The robot with `theta`, for planning; without a measurement where the log has no efforts.
[[nodiscard]] DesignSubject subject_of(const PreparedGap& prepared, const Robot& robot, const Eigen::VectorXd& theta);

/// Limits of the robot file; speed and acceleration that it lacks are the largest of the log, 80 % of an effort limit are
/// planned with, the space is what the log's path took (at least 0.5 m about the start), the duration a third of the log's
/// within 20 and 60 s.
[[nodiscard]] MotionLimits limits_within(const PreparedGap& prepared, const Robot& robot);

/// Fills ConfusablePair::inseparable and reason. The signatures `on_log` (signatures() of `table`) are looked at on a few random
/// manoeuvres within limits_within(), without noise and with the log's channels. Where on all of them the columns of the
/// one are sums of columns of the other, it is a special case of it. A pair is inseparable where on all of them either one
/// makes up the other but for 10⁻³ of its sum of squares. Else the log did not excite what tells the two apart. Nothing is
/// filled where no motion is within the limits.
void judge_pairs(std::vector<ConfusablePair>& pairs, const CandidateTable& table,
                 const std::vector<std::optional<Signature>>& on_log, BaseModel base, const PreparedGap& prepared,
                 const Robot& robot, const BlockOptions& blocks);

}  // namespace wheelwright

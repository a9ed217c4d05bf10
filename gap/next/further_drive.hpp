// SPDX-License-Identifier: Apache-2.0
/// \file
/// Planned drives of a robot whose log was analysed: within what limits, what they would tell, and the one that
/// discriminates between the causes that the log leaves possible.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "commission/design/plan.hpp"
#include "commission/design/subject.hpp"
#include "core/log.hpp"
#include "gap/causes/candidate.hpp"
#include "gap/causes/confusion.hpp"
#include "gap/diagnose.hpp"
#include "gap/diagnosis.hpp"
#include "gap/next/discrimination_design.hpp"
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

/// The next drive to record.
struct NextDrive {
  std::vector<Rival> rivals;         ///< members of the credible set as fitted to the log, in its order
  std::vector<Effect> laws;          ///< that their causes follow, one of each name
  std::optional<LogTable> commands;  ///< of the wheels; nothing where no drive tells any two of the rivals apart
  std::string sentence;              ///< what the drive promises, and what no drive can
};

/// Designs the drive for the credible set of `diagnosis`, the first few members of it: each fitted to the log again, of
/// the robot and options that diagnosed it. Limits are those of the robot file; where it has none, what the log itself
/// drove: speeds, accelerations, and with a pose the distance from the start. Four fifths of the effort are planned
/// with, for the controller to have the rest. It lasts a third of the log, between 20 and 60 s. Where too few members
/// can be planned for in seconds, having shapes by the hundred, the sentence has the measurement that would split them.
[[nodiscard]] NextDrive next_drive(LogSource& log, LogSource* baseline, const Robot& robot, const Diagnosis& diagnosis,
                                   const DiagnoseOptions& options);

/// next_drive() where `diagnosis` is ambiguous; what hinders it, or what no drive can tell, becomes a note of it.
[[nodiscard]] NextDrive what_next(LogSource& log, LogSource* baseline, const Robot& robot, Diagnosis& diagnosis,
                                  const DiagnoseOptions& options);

}  // namespace wheelwright::gap

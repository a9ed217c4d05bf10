// SPDX-License-Identifier: Apache-2.0
/// \file
/// Preparation of a gap analysis: the drive, the nominal θ, the noise floor, the effects of the healthy robot.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/log.hpp"
#include "gap/diagnose.hpp"
#include "gap/diagnosis.hpp"
#include "gap/effort_units.hpp"
#include "gap/rows/drive.hpp"
#include "gap/rows/gap_rows.hpp"

namespace wheelwright::gap {

/// A log ready for the search.
struct PreparedGap {
  TorqueView view;                       ///< of the robot: all that follows is in its units
  std::vector<Effect> catalogue;         ///< that is looked for
  LogTable log;                          ///< the log as it was read, with torques
  std::optional<LogTable> baseline_log;  ///< of the healthy robot, or of a simulator
  Drive drive;                           ///< of the log, with its nominal θ
  std::optional<Drive> healthy_drive;    ///< of baseline_log
  Eigen::VectorXd theta;                 ///< p, nominal where `trusted`, else as fitted to the log
  std::vector<bool> trusted;             ///< p
  std::vector<FittedEffect> healthy;     ///< of the baseline's robot or simulator
  NoiseFloor floor;
  std::string floor_origin;  ///< in words
  GapReference reference = GapReference::robot_file;
  GapRowOptions row_options;
  std::optional<HealthyMisfit>
      misfit;  ///< of a healthy robot of whose efforts the model leaves more than 5 % of the mean
               ///< square beyond the noise of the sensors: what it leaves is no noise
  std::vector<std::string> notes;
};

/// θ by least squares on the filtered rows of `drive`, outputs weighted by their own residuals; instants at rest and
/// before the filter has settled left out; zeros for a drive without efforts. Throws InputError where too few instants
/// are left.
[[nodiscard]] Eigen::VectorXd fit_base(const Drive& drive, double beta);

/// Reads the logs and settles all of this.
[[nodiscard]] PreparedGap prepare_gap(LogSource& log, LogSource* baseline, const Robot& robot,
                                      const DiagnoseOptions& options);

/// The column of an offset between the clocks of effort and speed: the rate of the efforts that the model predicts.
[[nodiscard]] Column clock_column(const Drive& drive);

/// The effects of `healthy` that are the robot's: the offset between the clocks of effort and speed is the logger's.
[[nodiscard]] std::vector<FittedEffect> robots_own(const std::vector<FittedEffect>& healthy);

/// The rows of `prepared` with the columns of its catalogue; `table` without its `gram`.
struct GapProblem {
  GapRows rows;
  CandidateTable table;
  std::vector<EffectKind> kinds;
};
[[nodiscard]] GapProblem make_problem(const Drive& drive, const NoiseFloor& floor,
                                      const std::vector<FittedEffect>& healthy, const std::vector<bool>& trusted,
                                      const std::vector<Effect>& catalogue, const ShapeGrids& shapes,
                                      const GapRowOptions& options);

/// Sets JointSignals::expected_effort of `drive` to what a model with `theta` and `causes` expects, the causes' own
/// efforts included: effects that grow with the effort are then right beyond first order. Causes of unit coefficient,
/// which are made of the measured effort, are left out.
void expect_efforts(Drive& drive, const Eigen::VectorXd& theta, const std::vector<FittedEffect>& causes);

/// The same with `set` fitted beside θ to the rows of `problem`.
void expect_efforts(PreparedGap& prepared, const GapProblem& problem, const CauseSet& set);

/// Residuals of `fit` of `subset` in each space, in its own unit.
[[nodiscard]] std::vector<Eigen::VectorXd> residuals(const GapRows& rows, const Subset& subset,
                                                     const Eigen::VectorXd& coefficients);

}  // namespace wheelwright::gap

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Shrinkage of the gap on held-out data once the causes are in the model, in four units; and the bias of the
/// parameters that the missing causes had caused.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gap/causes/candidate.hpp"
#include "gap/diagnosis.hpp"
#include "gap/prepared.hpp"
#include "gap/rollout.hpp"
#include "model/robot.hpp"

namespace wheelwright::gap {

/// Options of measure_shrink().
struct ShrinkOptions {
  BlockOptions blocks{};          ///< of time: each is predicted by the fit to the others
  RolloutOptions rollout{};       ///< its threads are those of these options
  std::size_t rollout_folds = 4;  ///< parts of the log that are rolled out with the parameters of the others
  bool commissioning = true;      ///< whether widths of thresholds and smallest faults are measured (most of the time)
  std::uint64_t seed = 1;
  std::size_t threads = 1;  ///< the result does not depend on it
};

/// The causes whose effect on the gap is measured.
struct ShrinkCauses {
  std::vector<FittedEffect> causes;      ///< their shapes are kept, their coefficients fitted again
  BaseModel base = BaseModel::refitted;  ///< what θ may do beside them
  std::optional<Robot> improved;         ///< the robot with all of them, fitted on the whole log, where there is one
};

/// Before (nominal θ and what the healthy robot has), after (θ as `base` says, with the causes), and what noise alone
/// leaves.
///
/// - torque_rms, per output: root mean square on filtered rows, each block of time by the fit to the others; the
///   interval is a moving-block bootstrap (Künsch 1989) over pairs of blocks. The floor is that of `prepared`.
/// - rollout: velocity (m/s), yaw_rate (rad/s), position (m), heading (rad), each at every horizon ("velocity_1s"), of
///   robots fitted on the other parts of the log; rollout.hpp. The floor is what the sensors' noise makes of them.
/// - threshold_width, per output: median of u − l on held-out blocks, of the log commissioned with `robot` and with
///   `improved`, both with the parameters of the base model; the floor is that of the baseline, commissioned with the
///   nominal robot, and 0 without one.
/// - smallest_fault, per output: the smallest certain change of both wheels' radius there, √(1 + κ) − 1, likewise.
///
/// The last two have no interval of their own (lower = after = upper). What cannot be measured is left out, and `notes`
/// says why. Throws InvalidArgument as make_gap_rows.
[[nodiscard]] GapShrink measure_shrink(const Robot& robot, const PreparedGap& prepared, const ShrinkCauses& found,
                                       const ShrinkOptions& options, std::vector<std::string>& notes);

/// θ as `robot` has it, as `gram`'s rows have it without causes, and with the causes `structural` (indices of
/// candidates of `table`; parametric ones would be the same columns as θ), with 95 % intervals by Student's t from the
/// covariance of BlockGram::fit. Physical units (Parameter::per_physical).
[[nodiscard]] std::vector<ParameterShift> parameter_shifts(const Robot& robot, const Drive& drive,
                                                           const CandidateTable& table,
                                                           const std::vector<std::size_t>& structural);

}  // namespace wheelwright::gap

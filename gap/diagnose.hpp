// SPDX-License-Identifier: Apache-2.0
/// \file
/// Diagnosis of a log's sim-to-real gap, all steps, and its validation on a fresh log.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/log.hpp"
#include "gap/causes/selection.hpp"
#include "gap/diagnosis.hpp"
#include "gap/effects/effect.hpp"
#include "gap/rows/gap_rows.hpp"

namespace wheelwright::gap {

/// Options of diagnose().
struct DiagnoseOptions {
  std::optional<std::vector<Effect>> catalogue;  ///< nothing: effect_catalogue() of the robot's model
  std::vector<std::string> without;              ///< names of effects that are not looked for
  std::optional<double> beta;  ///< of the filter, 1/s; nothing: at most 10, lower where the motion is noisy
  double window = 0.5;         ///< s, of pose increments
  BlockOptions blocks;         ///< of time, for held-out errors
  SelectionOptions selection;
  double sensor_floor =
      1.5;  ///< SelectionOptions::tolerated_floor without a healthy log: what the sensors show of their noise
            ///< (quantisation, rounding, correlated errors left out) is a floor of this much error
  bool baseline_simulated = false;  ///< the baseline is a log of a simulator: it says what the model is that the robot
                                    ///< is compared with, and nothing of the robot's sensors
  bool shrink = true;               ///< whether it is measured how far the gap shrinks (most of the time)
  std::uint64_t seed = 1;
  std::size_t threads = 1;                                             ///< the result does not depend on it
  std::function<void(std::string_view stage, double share)> progress;  ///< may be empty
};

/// Columns that diagnose() needs of `log`, alternatives apart by "|": the motion of every joint, and its effort unless
/// the log has the effort of none and a heading instead (`theta` or `gyro_z`).
[[nodiscard]] std::vector<std::string> required_columns(const LogSource& log, const Robot& robot);

/// Diagnoses `log` against the model of `robot`. With `baseline`, a log of the healthy robot, its θ is the nominal one
/// and what it leaves is the noise floor; effects that the healthy robot has already are taken as known. So are θ and
/// effects of a simulator (`baseline_simulated`), of which the floor is what its log leaves beside the noise of the
/// sensors of `log`. Without a baseline θ is nominal as far as the robot file says, and the floor is made of the
/// sensors' noise. Throws InputError or InvalidArgument for a log or robot that cannot be used at all; what the data
/// say is in the result.
[[nodiscard]] Diagnosis diagnose(LogSource& log, LogSource* baseline, const Robot& robot,
                                 const DiagnoseOptions& options = {});

/// Residual of the filtered efforts of `fresh`, a log of the same robot that was not used: the nominal model
/// (`before`), and the one with θ and causes as `found` has them (`after`, with the interval of a block bootstrap);
/// nothing is fitted to it. With the filter of `found`, `options` and `baseline` as it was made with; nothing for a log
/// without efforts. Throws as diagnose() does.
[[nodiscard]] std::vector<ShrinkFigure> torque_on(LogSource& fresh, LogSource* baseline, const Robot& robot,
                                                  const Diagnosis& found, const DiagnoseOptions& options = {});

}  // namespace wheelwright::gap

namespace wheelwright {
using gap::diagnose;
}  // namespace wheelwright

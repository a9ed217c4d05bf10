// SPDX-License-Identifier: Apache-2.0
/// \file
/// Setting of a commissioning, fixed before any fit: model, filter, measurement, declared noise.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "bounds/box.hpp"
#include "commission/choice/filter_choice.hpp"
#include "commission/survey.hpp"
#include "commission/validation.hpp"
#include "core/log.hpp"
#include "identify/estimate.hpp"
#include "model/filter/measurement.hpp"
#include "model/filter/noise.hpp"
#include "model/robot.hpp"

namespace wheelwright::commission {

/// Noise of the motion column, independent from sample to sample, the same in all joints.
struct MotionNoise {
  double sd = 0.0;           ///< rad for angles and the angles behind mean speeds, else rad/s (linear axes: m, m/s)
  double relative_sd = 0.0;  ///< error of sd², relative to it: its standard error, and what a correlation of
                             ///< neighbouring errors could hide (difference_noise.hpp); 0 for an upper limit
  bool upper_limit = false;  ///< from a bound (declared, or half a count): the noise may be smaller
  std::string origin;        ///< in words
};

/// Everything that is known before a fit.
struct Setting {
  Robot robot;  ///< with the parameters that the model was given
  Model model;
  Measurement measurement;
  FilterDesign filter;
  FilterChoice filter_choice;  ///< the curve is empty where the filter was given
  Survey survey;
  filter::SignalErrors
      declared;  ///< of the rows, from declared noise only; without error bounds where that is incomplete
  bool noise_complete = false;              ///< motion and effort are declared
  std::optional<MotionNoise> motion_noise;  ///< found by differences; else a limit, declared or from the encoder
  bool commands_are_noisy = false;          ///< logged commands share the noise of the motion: they are no instruments
  Box prior;
  std::vector<bool> prior_declared;  ///< p: the robot file's, not the tool's default
  FoldOptions folds;                 ///< purge is the filter's memory
  std::vector<std::string> notes;    ///< what was chosen, for people
};

/// Options of settle().
struct SettingOptions {
  FilterChoiceOptions filter_choice;
  FoldOptions folds;
  filter::NoiseMode noise_mode = filter::NoiseMode::worst_case;        ///< for declared noise
  double confidence = 0.999;                                           ///< statistical noise mode
  std::function<void(std::string_view stage, double share)> progress;  ///< may be empty
};

/// Looks at `log` (several walks) and settles all of it. Throws InputError or InvalidArgument for a log or robot that
/// cannot be used at all.
[[nodiscard]] Setting settle(LogSource& log, const Robot& robot, const SettingOptions& options = {});

/// Contribution of the noise of the motion (at its limit, where only that is known) to the rows' moments
/// (estimate.hpp), and the efforts' variance for total least squares where their noise is declared; nothing where it is
/// not known at all.
[[nodiscard]] std::optional<identify::RowNoise> row_noise(const Setting& setting);

}  // namespace wheelwright::commission

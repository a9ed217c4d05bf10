// SPDX-License-Identifier: Apache-2.0
/// \file
/// Other constant parameters as the cause of all alarms of a log: another ground or load than the model was learnt on.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "commission/detection.hpp"
#include "core/interval.hpp"
#include "core/log.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::commission {

/// A parameter whose bounds by a log have nothing in common with those of the model.
struct ChangedParameter {
  std::string name{};  ///< of the physical quantity where it is known, else of the residual's parameter
  std::string unit{};
  Interval before{};  ///< of the model
  Interval now{};     ///< by the log
};

/// Constant parameters that explain a whole log, the model's do not.
struct OtherParameters {
  std::vector<std::string> residuals{};     ///< torque, kinematic: those that alarmed, each explained by its own
  std::vector<ChangedParameter> changes{};  ///< none where only several together are other ones
};

/// Looks for constant parameters, in a wide box, that explain every row of every residual of `log` that alarmed
/// (`detection`, `kinematic`) within the errors that `model` has for it. Nothing where there are none: then it is
/// **proved that no constant parameters explain the log** within these errors, so that something changed during it, or
/// is not of the model's form. Where there are, a fault is not excluded: one that was there from the first row on may
/// look like other parameters. What the motion may do between samples is bounded for the model's own parameters.
///
/// Walks the log twice a residual. The box is the robot's prior for the torque residual, and for the kinematic one the
/// model's estimates times [1/2, 2] and biases within a whole of what they may be.
[[nodiscard]] std::optional<OtherParameters> explained_by_other_parameters(LogSource& log, const OnlineModel& model,
                                                                           const Detection& detection,
                                                                           const KinematicWatch& kinematic);

/// "other constant parameters explain the whole drive: the mass is 29.1 to 30.2 kg (20.9 to 21.2 before): …".
[[nodiscard]] std::string sentence(const OtherParameters& other);

}  // namespace wheelwright::commission

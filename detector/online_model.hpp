// SPDX-License-Identifier: Apache-2.0
/// \file
/// On-line model: the filters and detectors that are made of a learnt model.
#pragma once

#include "detector/detector.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::detector {

/// `model` with what decides by `residual`: for D2 without sums at a stated risk, which stand on bounds. Throws
/// InvalidArgument for D2 where the model has no constant thresholds of the torque residual.
[[nodiscard]] OnlineModel decided_by(OnlineModel model, Residual residual);

/// The filter of a channel.
[[nodiscard]] RegressorFilter make_filter(const OnlineModel& model);
[[nodiscard]] filter::OdometryFilter make_filter(const KinematicModel& model);

/// The detector of a channel. Where `options` have no persistence it is the model's. Throws InvalidArgument for options
/// that make no sense, and for D2 where the model has no constant thresholds.
[[nodiscard]] TorqueDetector make_detector(const OnlineModel& model, DetectorOptions options = {});
[[nodiscard]] KinematicDetector make_detector(const KinematicModel& model, DetectorOptions options = {});

}  // namespace wheelwright::detector

namespace wheelwright {
using detector::make_detector;
}  // namespace wheelwright

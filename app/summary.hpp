// SPDX-License-Identifier: Apache-2.0
/// \file
/// Results in a few lines for a terminal, and as JSON.
#pragma once

#include <optional>
#include <string>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/commission/detector_walk.hpp>
#include <wheelwright/files/json.hpp>

namespace wheelwright::app {

/// Summary of a commissioning for a terminal.
[[nodiscard]] std::string summary(const Commissioning& result);

/// Summary of a detection for a terminal.
[[nodiscard]] std::string summary(const Detection& detection, const OnlineModel& model);

/// Detection by the kinematic residual, beside that by the torque residual.
struct KinematicWatch {
  std::optional<Detection> detection;  ///< nothing where it was not watched
  std::string message;                 ///< why not, for people
};

/// The kinematic residual of `log`, where it and the model have one.
[[nodiscard]] KinematicWatch watch_kinematics(LogSource& log, const OnlineModel& model, const DetectorOptions& options,
                                              const DetectionOptions& detection = {});

/// `model` with the outputs of its kinematic model in the place of its own, for summary, event_line, to_json and
/// reports.
[[nodiscard]] OnlineModel with_kinematic_outputs(const OnlineModel& model);

/// Summary of the kinematic residual for a terminal.
[[nodiscard]] std::string summary(const KinematicWatch& watch, const OnlineModel& model);

/// Adds outputs and events of the kinematic residual to a detection as JSON; events stay in the order of their alarms.
void add_kinematic(Json& detection, const KinematicWatch& watch, const OnlineModel& model);

/// Summary of the isolation of the first events for a terminal.
[[nodiscard]] std::string summary(const std::vector<Isolation>& isolations, const Detection& detection);

/// Adds what its first events are isolated to to a detection as JSON, before add_kinematic().
void add_isolation(Json& detection, const std::vector<Isolation>& isolations);

/// Why a detector of `model` decided at no instant of `rows` rows with the median step `step` (s), with what to do
/// about it.
[[nodiscard]] std::string why_undecided(const OnlineModel& model, std::size_t rows, double step);

/// One event in a line.
[[nodiscard]] std::string event_line(const Event& event, const OnlineModel& model);

/// A detection as JSON (results/detection.schema.json). `model_file` and `log` say what was used.
[[nodiscard]] Json to_json(const Detection& detection, const OnlineModel& model, const std::string& model_file,
                           const std::string& log);

/// One event as JSON.
[[nodiscard]] Json to_json(const Event& event, const OnlineModel& model);

}  // namespace wheelwright::app

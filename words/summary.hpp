// SPDX-License-Identifier: Apache-2.0
/// \file
/// Results in a few lines for a terminal.
#pragma once

#include <optional>
#include <string>

#include <wheelwright/commission/commission.hpp>
#include <wheelwright/commission/detector_walk.hpp>
#include <wheelwright/commission/risk_watch.hpp>

namespace wheelwright::words {

/// Summary of a commissioning for a terminal.
[[nodiscard]] std::string summary(const Commissioning& result);

/// Summary of a detection for a terminal.
[[nodiscard]] std::string summary(const Detection& detection, const OnlineModel& model);

/// Summary of the kinematic residual for a terminal.
[[nodiscard]] std::string summary(const commission::KinematicWatch& watch, const OnlineModel& model);

/// Summary of the detector at a stated risk for a terminal; empty where the model says nothing at a risk.
[[nodiscard]] std::string summary(const commission::RiskWatch& watch, const OnlineModel& model);

/// Summary of the isolation of the first events for a terminal.
[[nodiscard]] std::string summary(const std::vector<detector::Isolation>& isolations, const Detection& detection);

/// Why a detector of `model` decided at no instant of `rows` rows with the median step `step` (s), with what to do
/// about it.
[[nodiscard]] std::string why_undecided(const OnlineModel& model, std::size_t rows, double step);

/// One event in a line.
[[nodiscard]] std::string event_line(const detector::Event& event, const OnlineModel& model);

}  // namespace wheelwright::words

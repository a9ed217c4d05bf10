// SPDX-License-Identifier: Apache-2.0
/// \file
/// A detection in lines for a terminal, and the lines of a stream as it is watched.
#pragma once

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "commission/detection.hpp"
#include "commission/watch/blind_watch.hpp"
#include "commission/watch/other_parameters.hpp"
#include "commission/watch/risk_watch.hpp"
#include "detector/events.hpp"
#include "detector/incidents.hpp"
#include "detector/learnt_model.hpp"

namespace wheelwright::words {

/// Summary of a detection for a terminal.
[[nodiscard]] std::string summary(const Detection& detection, const OnlineModel& model);

/// Summary of the kinematic residual for a terminal.
[[nodiscard]] std::string summary(const commission::KinematicWatch& watch, const OnlineModel& model);

/// Summary of the detector at a stated risk for a terminal; empty where the model says nothing at a risk.
[[nodiscard]] std::string summary(const commission::RiskWatch& watch, const OnlineModel& model);

/// Other parameters as the cause of all alarms, for a terminal: a line; empty where they are none.
[[nodiscard]] std::string summary(const std::optional<commission::OtherParameters>& other);

/// The incidents for a terminal, a line each; empty where there are none. `clock` makes the moment by a wall clock of a
/// time of the log (s), empty where there is none.
[[nodiscard]] std::string summary(const std::vector<detector::Incident>& incidents,
                                  const std::function<std::string(double)>& clock = {});

/// Why a detector of `model` decided at no instant of `rows` rows with the median step `step` (s), or at instants that
/// tell nothing (commission::hardly_goes_on()), with what to do about it.
[[nodiscard]] std::string why_undecided(const OnlineModel& model, std::size_t rows, double step);

/// Why `detection`, by `model`, says nothing of a log as a whole (commission::how_watched()), with what to do about it;
/// empty where it does. `rows` are those with the median step `step` (s), `met` those that were met, and `repairs` says
/// what reading found.
[[nodiscard]] std::string why_not_decided(const Detection& detection, const OnlineModel& model, std::size_t rows,
                                          double step, std::size_t met, const std::vector<std::string>& repairs);

/// Why most of a log was not decided on: `instants` of the `rows` that were met; `repairs` says what reading found.
[[nodiscard]] std::string why_mostly_undecided(std::size_t instants, std::size_t rows,
                                               const std::vector<std::string>& repairs);

/// Why rows of a stream bring no decision: `causes`, or that they are too few for the filter of `model`.
[[nodiscard]] std::string why_blind(const OnlineModel& model, const std::vector<std::string>& causes);

/// That `rows` of a stream were so near to those before them by its clock that they tell nothing to `model`.
[[nodiscard]] std::string crawling_words(const OnlineModel& model, std::size_t rows);

/// A spell without decisions in a line, for the reason `why`; `until` (s) where it is over.
[[nodiscard]] std::string blind_line(const commission::BlindSpell& spell, std::optional<double> until,
                                     const std::string& why);

/// A time in which no row of a stream came in a line.
[[nodiscard]] std::string silence_line(const commission::StreamSilence& silence);

/// One event in a line.
[[nodiscard]] std::string event_line(const detector::Event& event, const OnlineModel& model);

}  // namespace wheelwright::words

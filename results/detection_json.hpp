// SPDX-License-Identifier: Apache-2.0
/// \file
/// detection.json: decisions, events and their isolation.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "commission/detection.hpp"
#include "commission/watch/blind_watch.hpp"
#include "commission/watch/other_parameters.hpp"
#include "commission/watch/risk_watch.hpp"
#include "detector/events.hpp"
#include "detector/faults/isolation.hpp"
#include "detector/incidents.hpp"
#include "detector/learnt_model.hpp"
#include "formats/files/json.hpp"

namespace wheelwright::results {

/// Word for the warrant of thresholds: that of D1's, "experiment" of D2's, which have none.
[[nodiscard]] std::string_view threshold_word(core::Warrant warrant, detector::Residual residual);

/// A detection as JSON (results/detection.schema.json). `model_file` and `log` say what was used, `software` is name
/// and version.
[[nodiscard]] Json to_json(const Detection& detection, const OnlineModel& model, const std::string& model_file,
                           const std::string& log, const std::string& software);

/// One event as JSON.
[[nodiscard]] Json to_json(const detector::Event& event, const OnlineModel& model);

/// A spell without decisions as JSON, for the reason `why`; `until` (s) where it is over.
[[nodiscard]] Json to_json(const commission::BlindSpell& spell, std::optional<double> until, const std::string& why);

/// A time in which no row of a stream came as JSON.
[[nodiscard]] Json to_json(const commission::StreamSilence& silence);

/// An incident as JSON.
[[nodiscard]] Json to_json(const detector::Incident& incident);

/// Adds the incidents, in their order, to a detection as JSON.
void add_incidents(Json& detection, const std::vector<detector::Incident>& incidents);

/// Adds to a detection with alarms whether other constant parameters explain them all, and which: null where they do
/// not.
void add_other_parameters(Json& detection, const std::optional<commission::OtherParameters>& other);

/// Adds to a detection why its log as a whole was not decided on (words::why_not_decided()), and the share of the rows
/// that were not (commission::undecided_share()); nothing where `why` is empty, and where the share is 0.
void add_undecided(Json& detection, const std::string& why, double share);

/// Adds what its first events are isolated to to a detection as JSON, before add_kinematic().
void add_isolation(Json& detection, const std::vector<detector::Isolation>& isolations);

/// Adds outputs and events of the kinematic residual to a detection as JSON; events stay in the order of their alarms.
[[nodiscard]] Json to_json(const commission::RiskEvent& event, const OnlineModel& model);
void add_at_risk(Json& json, const commission::RiskWatch& watch, const OnlineModel& model);
void add_kinematic(Json& detection, const commission::KinematicWatch& watch, const OnlineModel& model);

}  // namespace wheelwright::results

// SPDX-License-Identifier: Apache-2.0
/// \file
/// detection.json: decisions, events and their isolation; margins.json and choice.json: the results of `wheelwright
/// margins` and `wheelwright choose`.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "commission/choice/detector_choice.hpp"
#include "commission/margin_survey.hpp"
#include "commission/watch/blind_watch.hpp"
#include "commission/watch/detector_walk.hpp"
#include "commission/watch/incident_watch.hpp"
#include "commission/watch/risk_watch.hpp"
#include "formats/files/json.hpp"

namespace wheelwright::results {

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

/// Adds to a detection why its log as a whole was not decided on (words::why_not_decided()), and the share of the rows
/// that were not (commission::undecided_share()); nothing where `why` is empty, and where the share is 0.
void add_undecided(Json& detection, const std::string& why, double share);

/// Adds what its first events are isolated to to a detection as JSON, before add_kinematic().
void add_isolation(Json& detection, const std::vector<detector::Isolation>& isolations);

/// Adds outputs and events of the kinematic residual to a detection as JSON; events stay in the order of their alarms.
[[nodiscard]] Json to_json(const commission::RiskEvent& event, const OnlineModel& model);
void add_at_risk(Json& json, const commission::RiskWatch& watch, const OnlineModel& model);
void add_kinematic(Json& detection, const commission::KinematicWatch& watch, const OnlineModel& model);

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kMarginsSchema = "wheelwright/margins/1";

/// The whole survey as JSON (results/margins.schema.json). `model` and `log` say what it was made of, `software` is
/// name and version.
[[nodiscard]] Json to_json(const commission::MarginSurvey& survey, const std::string& model, const std::string& log,
                           const std::string& software);

/// Name of the format: the value of its key `schema`.
inline constexpr const char* kChoiceSchema = "wheelwright/choice/1";

/// The whole choice as JSON (results/choice.schema.json). `robot` and `logs` say what it was made of, `software` is
/// name and version.
[[nodiscard]] Json to_json(const commission::DetectorChoice& choice, const std::string& robot,
                           const std::vector<std::string>& logs, const std::string& software);

/// The line of a robot file that asks for this filter.
[[nodiscard]] std::string robot_file_line(const FilterDesign& filter);

}  // namespace wheelwright::results

// SPDX-License-Identifier: Apache-2.0
#include "results/detection_json.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "commission/event_isolation.hpp"
#include "formats/files/json.hpp"
#include "results/assumptions_json.hpp"
#include "results/model_json.hpp"
#include "results/words/detect_words.hpp"

namespace wheelwright::results {

std::string_view threshold_word(core::Warrant warrant, detector::Residual residual) {
  return residual == detector::Residual::d2 ? "experiment" : core::warrant_word(warrant);
}

Json to_json(const detector::Event& e, const OnlineModel& model) {
  return {{"output", model.model.outputs[e.output]},
          {"start", e.start},
          {"alarm", e.alarm},
          {"end", e.end},
          {"peak_time", e.peak_time},
          {"peak_residual", e.peak_residual},
          {"peak_ratio", e.peak_ratio},
          {"instants", e.instants},
          {"start_row", e.start_sample}};
}

Json to_json(const Detection& d, const OnlineModel& model, const std::string& model_file, const std::string& log,
             const std::string& software) {
  Json json = {{"schema", "wheelwright/detection/1"},
               {"software", software},
               {"model", model_file},
               {"log", log},
               {"warrant", threshold_word(model.warrant, d.residual)},
               {"assumptions", assumptions_json(model.assumptions)},
               {"fault", !d.events.empty()},
               {"rows", d.rows},
               {"instants", d.instants},
               {"seconds", d.seconds},
               {"outputs", Json::array()},
               {"events", Json::array()}};
  for (std::size_t i = 0; i < d.outside.size(); ++i) {
    json["outputs"].push_back({{"output", model.model.outputs[i]},
                               {"instants_outside", d.outside[i]},
                               {"utilisation", d.utilisation[i]},
                               {"nrmse", d.nrmse[i]}});
  }
  for (const detector::Event& event : d.events) {
    json["events"].push_back(to_json(event, model));
  }
  if (d.residual == detector::Residual::d2) {
    json["residual"] = detector::residual_word(d.residual);
    json["constant_thresholds"] = constant_thresholds_json(*model.constant, model.model.outputs);
  }
  return json;
}

namespace {

Json finding_json(const detector::FaultFinding& f) {
  Json entry = {{"fault", f.fault.name}, {"magnitude", nullptr}, {"onset", {f.onset.lower, f.onset.upper}},
                {"unit", f.fault.unit},  {"earlier", f.earlier}, {"complete", f.complete}};
  if (f.magnitude) {
    entry["magnitude"] = {f.magnitude->lower, f.magnitude->upper};
  }
  if (f.at_risk) {
    Json& at_risk = entry["at_risk"];
    at_risk = {{"excluded", f.at_risk->excluded}, {"magnitude", nullptr}, {"onset", nullptr}};
    if (f.at_risk->magnitude) {
      at_risk["magnitude"] = {f.at_risk->magnitude->lower, f.at_risk->magnitude->upper};
    }
    if (!f.at_risk->excluded) {
      at_risk["onset"] = {f.at_risk->onset.lower, f.at_risk->onset.upper};
    }
  }
  return entry;
}

Json size_json(const detector::SizeOverTime& size) {
  Json means = Json::array(), growing = Json::array();
  for (const detector::MeanSize& mean : size.means) {
    means.push_back({{"from", mean.from}, {"to", mean.to}, {"lower", mean.size.lower}, {"upper", mean.size.upper}});
  }
  for (const detector::SizeAt& at : size.growing) {
    growing.push_back({{"t", at.t}, {"lower", at.size.lower}, {"upper", at.size.upper}});
  }
  return {{"fault", size.fault.name},
          {"unit", size.fault.unit},
          {"means", std::move(means)},
          {"growing", std::move(growing)},
          {"growing_excluded", size.growing_excluded},
          {"sentence", commission::sentence(size)}};
}

const char* course_name(detector::CourseClass course) {
  switch (course) {
    case detector::CourseClass::step: return "step";
    case detector::CourseClass::growing: return "growing";
    case detector::CourseClass::any: break;
  }
  return "any";
}

}  // namespace

Json to_json(const detector::Incident& incident) {
  Json candidates = Json::array();
  for (const detector::IncidentCandidate& candidate : incident.candidates) {
    Json entry = finding_json(candidate.finding);
    entry["changes"] = candidate.changes;
    entry["events"] = candidate.events;
    entry["since"] = candidate.since;
    entry["course"] = course_name(candidate.course);
    const auto number = [](const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); };
    entry["behind"] = number(candidate.behind);
    entry["left"] = number(candidate.left);
    entry["guess"] = number(candidate.guess);
    entry["as_likely"] = candidate.as_likely;
    entry["sentence"] = commission::sentence(candidate.finding);
    candidates.push_back(std::move(entry));
  }
  Json sizes = Json::array();
  for (const detector::SizeOverTime& size : incident.sizes) {
    sizes.push_back(size_json(size));
  }
  return {{"start", incident.start},       {"alarm", incident.alarm},
          {"end", incident.end},           {"events", incident.events},
          {"examined", incident.examined}, {"unexplained", incident.unexplained},
          {"stays", incident.stays},       {"candidates", std::move(candidates)},
          {"sizes", std::move(sizes)},     {"sentence", words::incident_sentence(incident)}};
}

void add_incidents(Json& detection, const std::vector<detector::Incident>& incidents) {
  Json& list = detection["incidents"] = Json::array();
  for (const detector::Incident& incident : incidents) {
    list.push_back(to_json(incident));
  }
}

void add_other_parameters(Json& detection, const std::optional<commission::OtherParameters>& other) {
  Json& entry = detection["other_parameters"] = nullptr;
  if (!other) {
    return;
  }
  Json changes = Json::array();
  for (const commission::ChangedParameter& change : other->changes) {
    changes.push_back({{"parameter", change.name},
                       {"unit", change.unit},
                       {"before", {change.before.lower, change.before.upper}},
                       {"now", {change.now.lower, change.now.upper}}});
  }
  entry = {
      {"residuals", other->residuals}, {"changes", std::move(changes)}, {"sentence", commission::sentence(*other)}};
}

void add_undecided(Json& detection, const std::string& why, double share) {
  if (!why.empty()) {
    detection["undecided"] = why;
  }
  if (share > 0.0) {
    detection["undecided_share"] = share;
  }
}

void add_isolation(Json& detection, const std::vector<detector::Isolation>& isolations) {
  using Verdict = detector::FaultFinding::Verdict;
  for (std::size_t k = 0; k < isolations.size(); ++k) {
    Json &event = detection["events"][k], consistent = Json::array(), excluded = Json::array(), open = Json::array();
    for (const detector::FaultFinding& f : isolations[k].findings) {
      if (f.verdict == Verdict::excluded) {
        excluded.push_back(f.fault.name);
      } else if (f.verdict == Verdict::not_examined) {
        open.push_back(f.fault.name);
      } else {
        consistent.push_back(finding_json(f));
      }
    }
    event["isolation"] = std::move(consistent);
    event["excluded"] = std::move(excluded);
    event["not_examined"] = std::move(open);
    event["explanation"] = commission::sentence(isolations[k]);
  }
}

Json to_json(const commission::BlindSpell& spell, std::optional<double> until, const std::string& why) {
  return {{"since", files::or_null(spell.since)},
          {"until", files::or_null(until)},
          {"rows", spell.rows},
          {"seconds", spell.seconds},
          {"reason", why}};
}

Json to_json(const commission::StreamSilence& silence) {
  return {
      {"since", files::or_null(silence.since)}, {"until", files::or_null(silence.until)}, {"seconds", silence.seconds}};
}

Json to_json(const commission::RiskEvent& e, const OnlineModel& model) {
  return {{"alarm", e.alarm},
          {"end", e.end},
          {"weight", e.pose ? e.pose->name : e.weight.name},
          {"residual", e.pose ? "kinematic" : "torque"},
          {"scale", e.scale},
          {"ratio", e.ratio},
          {"peak_time", e.peak_time},
          {"sentence", commission::sentence(e, model.model)}};
}

void add_at_risk(Json& json, const commission::RiskWatch& watch, const OnlineModel& model) {
  if (!watch.watched) {
    return;
  }
  Json events = Json::array();
  for (const commission::RiskEvent& e : watch.events) {
    events.push_back(to_json(e, model));
  }
  json["at_risk"] = {{"false_alarms_per_year", watch.false_alarms * 365.25 * 86400.0},
                     {"risk_of_the_set", (model.at_risk ? model.at_risk->risk : 0.0) +
                                             (watch.pose ? model.kinematic->at_risk->risk : 0.0)},
                     {"looks", watch.looks},
                     {"utilisation", watch.utilisation},
                     {"events", std::move(events)}};
  json["fault"] = json["fault"].get<bool>() || !watch.events.empty();
}

void add_kinematic(Json& detection, const commission::KinematicWatch& watch, const OnlineModel& model) {
  const Detection none;
  const Detection& d = watch.detection ? *watch.detection : none;
  const OnlineModel view = commission::with_kinematic_outputs(model);
  const Json own = to_json(d, view, {}, {}, {});
  for (const Json& output : own.at("outputs")) {
    detection["outputs"].push_back(output);
  }
  std::vector<Json> events = detection.at("events").get<std::vector<Json>>();
  events.insert(events.end(), own.at("events").begin(), own.at("events").end());
  std::ranges::stable_sort(events, {}, [](const Json& event) { return event.at("alarm").get<double>(); });
  detection["events"] = events;
  detection["fault"] = detection["fault"].get<bool>() || !events.empty();
  detection["kinematic"] = {{"warrant", threshold_word(view.warrant, d.residual)},
                            {"watched", watch.detection.has_value()},
                            {"message", watch.message},
                            {"instants", d.instants},
                            {"seconds", d.seconds}};
  if (own.contains("constant_thresholds")) {
    detection["kinematic"]["constant_thresholds"] = own["constant_thresholds"];
  }
}

}  // namespace wheelwright::results

// SPDX-License-Identifier: Apache-2.0
#include "results/detection_json.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "formats/files/json.hpp"
#include "results/model_json.hpp"
#include "results/words/detect_words.hpp"

namespace wheelwright::results {

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
               {"warrant", core::warrant_word(model.warrant)},
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

}  // namespace

Json to_json(const detector::Incident& incident) {
  Json candidates = Json::array();
  for (const detector::IncidentCandidate& candidate : incident.candidates) {
    Json entry = finding_json(candidate.finding);
    entry["changes"] = candidate.changes;
    entry["sentence"] = commission::sentence(candidate.finding);
    candidates.push_back(std::move(entry));
  }
  return {{"start", incident.start},
          {"alarm", incident.alarm},
          {"end", incident.end},
          {"events", incident.events},
          {"examined", incident.examined},
          {"unexplained", incident.unexplained},
          {"candidates", std::move(candidates)},
          {"sentence", words::incident_sentence(incident)}};
}

void add_incidents(Json& detection, const std::vector<detector::Incident>& incidents) {
  Json& list = detection["incidents"] = Json::array();
  for (const detector::Incident& incident : incidents) {
    list.push_back(to_json(incident));
  }
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
  detection["kinematic"] = {{"warrant", core::warrant_word(view.warrant)},
                            {"watched", watch.detection.has_value()},
                            {"message", watch.message},
                            {"instants", d.instants},
                            {"seconds", d.seconds}};
}

using commission::Guarantee;
using files::or_null;

using namespace words;
namespace {

Json sizes_json(const std::vector<double>& sizes) {
  Json list = Json::array();
  for (const double size : sizes) {
    list.push_back(or_null(size));
  }
  return list;
}

const char* name_of(detector::ManoeuvreKind kind) {
  switch (kind) {
    case detector::ManoeuvreKind::standstill: return "standstill";
    case detector::ManoeuvreKind::cruising: return "cruising";
    case detector::ManoeuvreKind::accelerating: return "accelerating";
    case detector::ManoeuvreKind::turning: return "turning";
    case detector::ManoeuvreKind::spinning: return "spinning";
  }
  return "";
}

Json summary_json(const detector::FaultMargins& margins, const commission::MarginSurvey& survey,
                  const std::vector<std::string>& outputs) {
  Json list = Json::array();
  for (const auto& [kind, count] : survey.manoeuvres) {
    for (std::size_t w = 0; w < survey.windows.size(); ++w) {
      const detector::MarginSummary all = detector::summarise(margins, w, kind);
      if (all.onsets == 0) {
        continue;
      }
      Json channels = Json::object();
      for (std::size_t i = 0; i < outputs.size(); ++i) {
        channels[outputs[i]] = or_null(detector::summarise(margins, w, kind, i).worst);
      }
      list.push_back({{"manoeuvre", name_of(kind)},
                      {"window", survey.windows[w]},
                      {"onsets", all.onsets},
                      {"certain_at", all.certain},
                      {"best", or_null(all.best)},
                      {"median", or_null(all.median)},
                      {"worst", or_null(all.worst)},
                      {"worst_by_output", std::move(channels)}});
    }
  }
  return list;
}

Json onsets_json(const detector::FaultMargins& margins) {
  Json list = Json::array();
  for (const detector::OnsetMargin& onset : margins.onsets) {
    list.push_back({{"t", onset.t},
                    {"manoeuvre", name_of(onset.kind)},
                    {"certain", sizes_json(onset.certain)},
                    {"hidden", or_null(onset.hidden)}});
  }
  return list;
}

Json map_json(const detector::OperatingMap& map) {
  Json smallest = Json::array();
  for (Eigen::Index a = 0; a < map.smallest.rows(); ++a) {
    Json row = Json::array();
    for (Eigen::Index b = 0; b < map.smallest.cols(); ++b) {
      row.push_back(or_null(map.smallest(a, b)));
    }
    smallest.push_back(std::move(row));
  }
  return {{"first", map.plane.x}, {"second", map.plane.y}, {"smallest", std::move(smallest)}};
}

Json fault_json(const detector::FaultMargins& margins, const commission::MarginSurvey& survey,
                const commission::ResidualMargins& residual) {
  Json json = {{"fault", margins.fault.name},
               {"sentence", margins.fault.sentence},
               {"unit", margins.fault.unit},
               {"side", margins.side > 0.0 ? "positive" : "negative"},
               {"whole", margins.fault.whole},
               {"largest", margins.largest()},
               {"summary", summary_json(margins, survey, residual.outputs)},
               {"onsets", onsets_json(margins)}};
  for (const commission::FaultMaps& maps : residual.maps) {
    if (maps.fault == margins.fault.name && maps.side == margins.side) {
      json["map"] = {{"speeds", map_json(maps.speeds)}, {"accelerations", map_json(maps.accelerations)}};
    }
  }
  return json;
}

Json risk_faults_json(const std::vector<detector::FaultMargins>& all, const std::vector<double>& windows) {
  Json faults = Json::array();
  for (const detector::FaultMargins& margins : all) {
    Json summary = Json::array(), onsets = Json::array();
    for (std::size_t w = 0; w < windows.size(); ++w) {
      const detector::MarginSummary at_all = detector::summarise(margins, w);
      if (at_all.onsets > 0) {
        summary.push_back({{"window", windows[w]},
                           {"onsets", at_all.onsets},
                           {"certain_at", at_all.certain},
                           {"best", or_null(at_all.best)},
                           {"median", or_null(at_all.median)},
                           {"worst", or_null(at_all.worst)}});
      }
    }
    for (const detector::OnsetMargin& onset : margins.onsets) {
      onsets.push_back({{"t", onset.t}, {"manoeuvre", name_of(onset.kind)}, {"certain", sizes_json(onset.certain)}});
    }
    faults.push_back({{"fault", margins.fault.name},
                      {"unit", margins.fault.unit},
                      {"side", margins.side > 0.0 ? "positive" : "negative"},
                      {"whole", margins.fault.whole},
                      {"largest", margins.largest()},
                      {"summary", std::move(summary)},
                      {"onsets", std::move(onsets)}});
  }
  return faults;
}

Json risk_json(const commission::RiskMargins& at_risk) {
  return {{"risk", at_risk.risk},
          {"miss", at_risk.miss},
          {"false_alarms", at_risk.false_alarms},
          {"windows", at_risk.windows},
          {"torque", at_risk.torque},
          {"faults", risk_faults_json(at_risk.margins, at_risk.windows)},
          {"pose_faults", risk_faults_json(at_risk.pose, at_risk.windows)}};
}

}  // namespace

Json to_json(const commission::MarginSurvey& survey, const std::string& model, const std::string& log,
             const std::string& software) {
  Json json = {{"schema", kMarginsSchema},
               {"software", software},
               {"model", model},
               {"log", log},
               {"seconds", survey.seconds},
               {"windows", survey.windows},
               {"persistence", {{"k", survey.persistence.k}, {"n", survey.persistence.n}}},
               {"noise_share", survey.noise_share},
               {"without_kinematic", survey.without_kinematic},
               {"sentences", margin_sentences(survey)}};
  json["manoeuvres"] = Json::array();
  for (const auto& [kind, count] : survey.manoeuvres) {
    json["manoeuvres"].push_back({{"manoeuvre", name_of(kind)}, {"onsets", count}});
  }
  json["residuals"] = Json::array();
  for (const commission::ResidualMargins& residual : survey.residuals) {
    Json faults = Json::array();
    for (const detector::FaultMargins& margins : residual.margins) {
      faults.push_back(fault_json(margins, survey, residual));
    }
    json["residuals"].push_back({{"residual", residual.name},
                                 {"warrant", core::warrant_word(residual.warrant)},
                                 {"outputs", residual.outputs},
                                 {"blind", residual.blind},
                                 {"faults", std::move(faults)}});
  }
  json["at_risk"] = survey.at_risk ? risk_json(*survey.at_risk) : Json(nullptr);
  json["without_risk"] = survey.without_risk;
  json["assumptions"] = assumptions_json(survey.assumptions);
  return json;
}

namespace {

const char* name_of(Guarantee guarantee) {
  switch (guarantee) {
    case Guarantee::never: return "never";
    case Guarantee::hourly: return "hourly";
    case Guarantee::extrapolated: return "extrapolated";
  }
  return "";
}

core::Warrant warrant_of(Guarantee guarantee) {
  switch (guarantee) {
    case Guarantee::never: return core::Warrant::guaranteed;
    case Guarantee::hourly: return core::Warrant::statistical;
    case Guarantee::extrapolated: return core::Warrant::extrapolated;
  }
  return core::Warrant::extrapolated;
}

Json filter_json(const FilterDesign& filter) {
  return {{"order", filter.order}, {"alpha", filter.alpha}, {"beta", filter.beta}};
}

Json sizes_json(const std::optional<commission::StatedSizes>& sizes) {
  return sizes ? Json{{"median", or_null(sizes->median)},
                      {"worst", or_null(sizes->worst)},
                      {"delay", or_null(sizes->delay)}}
               : Json(nullptr);
}

Json candidate_json(const commission::DetectorCandidate& candidate) {
  Json faults = Json::array();
  for (const commission::StatedMargin& margin : candidate.faults) {
    faults.push_back({{"fault", margin.fault},
                      {"side", margin.side > 0.0 ? "positive" : "negative"},
                      {"unit", margin.unit},
                      {"asked", margin.asked},
                      {"onsets", margin.onsets},
                      {"median", or_null(margin.median)},
                      {"worst", or_null(margin.worst)},
                      {"delay", or_null(margin.delay)},
                      {"at_risk", sizes_json(margin.at_risk)},
                      {"either", sizes_json(margin.either)}});
  }
  return {{"filter", filter_json(candidate.filter)},
          {"guarantee", name_of(candidate.guarantee)},
          {"warrant", core::warrant_word(warrant_of(candidate.guarantee))},
          {"persistence", {{"k", candidate.persistence.k}, {"n", candidate.persistence.n}}},
          {"origin", candidate.origin},
          {"failure", candidate.failure},
          {"size", or_null(candidate.size)},
          {"delay", or_null(candidate.delay)},
          {"size_at_risk", candidate.size_at_risk ? or_null(*candidate.size_at_risk) : Json(nullptr)},
          {"faults", std::move(faults)}};
}

}  // namespace

std::string robot_file_line(const FilterDesign& filter) {
  return fmt::format("filter: {{order: {}, alpha: {}, beta: {}}}", filter.order, filter.alpha, filter.beta);
}

Json to_json(const commission::DetectorChoice& choice, const std::string& robot, const std::vector<std::string>& logs,
             const std::string& software) {
  Json candidates = Json::array();
  for (const commission::DetectorCandidate& candidate : choice.candidates) {
    candidates.push_back(candidate_json(candidate));
  }
  const bool chosen = choice.chosen.has_value();
  Json at_risk, decides = Json::array();
  if (chosen && choice.candidates.front().miss) {
    const commission::DetectorCandidate& first = choice.candidates.front();
    at_risk = {{"miss", *first.miss},
               {"warrant", core::warrant_word(first.risk_warrant)},
               {"spread", choice.risk_spread ? or_null(*choice.risk_spread) : Json(nullptr)}};
    for (const commission::StatedMargin& margin : first.faults) {
      const std::optional<double> from = commission::risk_decides_from(margin, choice.window);
      decides.push_back({{"fault", margin.fault},
                         {"side", margin.side > 0.0 ? "positive" : "negative"},
                         {"at_risk_from", files::or_null(from)}});
    }
  }
  return {{"schema", kChoiceSchema},
          {"software", software},
          {"robot", robot},
          {"logs", logs},
          {"window", choice.window},
          {"false_alarms", choice.false_alarms},
          {"chosen", chosen ? filter_json(choice.candidates.front().filter) : Json(nullptr)},
          {"robot_file", chosen ? robot_file_line(choice.candidates.front().filter) : ""},
          {"hopeless", choice.hopeless},
          {"guarantee", choice.either ? "either" : "every_noise"},
          {"at_risk", std::move(at_risk)},
          {"decides", std::move(decides)},
          {"recommendation", choice_sentences(choice)},
          {"notes", choice.notes},
          {"candidates", std::move(candidates)}};
}

}  // namespace wheelwright::results

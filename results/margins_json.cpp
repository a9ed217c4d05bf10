// SPDX-License-Identifier: Apache-2.0
#include "results/margins_json.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "formats/files/json.hpp"
#include "results/assumptions_json.hpp"
#include "results/words/detect_words.hpp"

namespace wheelwright::results {

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

}  // namespace wheelwright::results

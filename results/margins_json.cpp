// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/margins_json.hpp>

#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <wheelwright/files/json.hpp>
#include <wheelwright/results/model_json.hpp>
#include <wheelwright/words/margin_words.hpp>

namespace wheelwright::results {

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

Json risk_json(const commission::RiskMargins& at_risk) {
  Json faults = Json::array();
  for (const detector::FaultMargins& margins : at_risk.margins) {
    Json summary = Json::array(), onsets = Json::array();
    for (std::size_t w = 0; w < at_risk.windows.size(); ++w) {
      const detector::MarginSummary all = detector::summarise(margins, w);
      if (all.onsets > 0) {
        summary.push_back({{"window", at_risk.windows[w]},
                           {"onsets", all.onsets},
                           {"certain_at", all.certain},
                           {"best", or_null(all.best)},
                           {"median", or_null(all.median)},
                           {"worst", or_null(all.worst)}});
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
  return {{"risk", at_risk.risk},
          {"miss", at_risk.miss},
          {"false_alarms", at_risk.false_alarms},
          {"windows", at_risk.windows},
          {"faults", std::move(faults)}};
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
                      {"delay", or_null(margin.delay)}});
  }
  return {{"filter", filter_json(candidate.filter)},
          {"guarantee", name_of(candidate.guarantee)},
          {"warrant", core::warrant_word(warrant_of(candidate.guarantee))},
          {"persistence", {{"k", candidate.persistence.k}, {"n", candidate.persistence.n}}},
          {"origin", candidate.origin},
          {"failure", candidate.failure},
          {"size", or_null(candidate.size)},
          {"delay", or_null(candidate.delay)},
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
  return {{"schema", kChoiceSchema},
          {"software", software},
          {"robot", robot},
          {"logs", logs},
          {"window", choice.window},
          {"false_alarms", choice.false_alarms},
          {"chosen", chosen ? filter_json(choice.candidates.front().filter) : Json(nullptr)},
          {"robot_file", chosen ? robot_file_line(choice.candidates.front().filter) : ""},
          {"hopeless", choice.hopeless},
          {"notes", choice.notes},
          {"candidates", std::move(candidates)}};
}

}  // namespace wheelwright::results

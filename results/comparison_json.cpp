// SPDX-License-Identifier: Apache-2.0
#include "results/comparison_json.hpp"

#include <nlohmann/json.hpp>

#include "formats/robots/online_model_file.hpp"
#include "results/words/comparison_words.hpp"

namespace wheelwright::results {
namespace {

Json interval(const Interval& x) { return {files::or_null(x.lower), files::or_null(x.upper)}; }

Json of_set(const commission::SetComparison& sets) {
  Json parameters = Json::array(), explanations = Json::array();
  for (const commission::ParameterChange& each : sets.parameters) {
    parameters.push_back({{"name", each.name},
                          {"quantity", each.quantity},
                          {"unit", each.unit},
                          {"before", interval(each.before)},
                          {"after", interval(each.after)},
                          {"change", interval(each.change)},
                          {"certain", each.certain()},
                          {"together", each.together ? interval(*each.together) : Json(nullptr)}});
  }
  for (const commission::ChangeExplanation& each : sets.explanations) {
    Json members = Json::array();
    for (std::size_t k = 0; k < each.parameters.size(); ++k) {
      members.push_back({{"name", sets.parameters[each.parameters[k]].name}, {"change", interval(each.change[k])}});
    }
    explanations.push_back(std::move(members));
  }
  return {{"of", sets.wheels ? "wheels" : "dynamics"},
          {"risk", files::or_null(sets.risk)},
          {"warrant", core::warrant_word(sets.warrant)},
          {"compatible", sets.compatible},
          {"parameters", std::move(parameters)},
          {"explanations", std::move(explanations)},
          {"sought", sets.sought}};
}

Json of_model(const ComparedModel& model) {
  return {{"file", model.file}, {"robot", model.robot}, {"software", model.software}, {"logs", model.logs}};
}

}  // namespace

ComparedModel compared_model(const std::string& file) {
  const Json json = files::read_json(file);
  const files::JsonPlace root = robots::model_root(json, file);
  ComparedModel model{.file = file,
                      .robot = root.at("robot").at("name").text(),
                      .software = root.has("software") ? root.at("software").text() : ""};
  if (root.has("data") && root.at("data").has("files")) {
    const files::JsonPlace logs = root.at("data").at("files");
    for (std::size_t k = 0; k < logs.size(); ++k) {
      model.logs.push_back({{"path", logs.at(k).at("path").text()}, {"hash", logs.at(k).at("hash").text()}});
    }
  }
  return model;
}

Json to_json(const commission::ModelComparison& comparison, const ComparedModel& before, const ComparedModel& after,
             const std::string& software) {
  Json sets = Json::array();
  for (const commission::SetComparison& each : comparison.sets) {
    sets.push_back(of_set(each));
  }
  Json json = {{"schema", "wheelwright/comparison/1"},
               {"software", software},
               {"before", of_model(before)},
               {"after", of_model(after)},
               {"changed", comparison.changed()},
               {"message", words::verdict(comparison)},
               {"explanations", words::explanations(comparison)},
               {"sets", std::move(sets)}};
  if (const std::string rest = words::not_compared(comparison); !rest.empty()) {
    json["not_compared"] = rest;
  }
  return json;
}

}  // namespace wheelwright::results

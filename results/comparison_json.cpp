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

Json of_guess(const commission::GuessChange& each) {
  return {{"quantity", each.before.quantity},
          {"unit", each.before.unit},
          {"before", {{"estimate", each.before.value}, {"standard_error", each.before.standard_error}}},
          {"after", {{"estimate", each.after.value}, {"standard_error", each.after.standard_error}}},
          {"standard_errors", each.standard_errors()},
          {"told", each.told()}};
}

// Nothing where the log gave no best guess, or none with a standard error.
void take_guess(const files::JsonPlace& place, const std::string& quantity, std::vector<commission::BestGuess>& out) {
  if (place.has("estimate") && place.has("standard_error")) {
    out.push_back({.quantity = quantity,
                   .unit = place.at("unit").text(),
                   .value = place.at("estimate").number(),
                   .standard_error = place.at("standard_error").number()});
  }
}

std::vector<commission::BestGuess> guesses_of(const files::JsonPlace& root) {
  std::vector<commission::BestGuess> out;
  if (root.has("physical")) {
    const files::JsonPlace physical = root.at("physical");
    for (const std::string& name : physical.keys()) {
      take_guess(physical.at(name), name, out);
    }
  } else if (root.has("parameters")) {
    const files::JsonPlace parameters = root.at("parameters");
    for (std::size_t k = 0; k < parameters.size(); ++k) {
      take_guess(parameters.at(k), parameters.at(k).at("name").text(), out);
    }
  }
  if (root.has("kinematic") && root.at("kinematic").has("parameters")) {
    const files::JsonPlace wheels = root.at("kinematic").at("parameters");
    for (std::size_t k = 0; k < wheels.size(); ++k) {
      take_guess(wheels.at(k), wheels.at(k).at("name").text(), out);
    }
  }
  return out;
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
  model.guesses = guesses_of(root);
  return model;
}

Json to_json(const commission::ModelComparison& comparison, const ComparedModel& before, const ComparedModel& after,
             const std::string& software) {
  Json sets = Json::array(), guesses = Json::array();
  for (const commission::GuessChange& each : comparison.guesses) {
    guesses.push_back(of_guess(each));
  }
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
               {"sets", std::move(sets)},
               {"guesses", std::move(guesses)}};
  if (const std::string rest = words::not_compared(comparison); !rest.empty()) {
    json["not_compared"] = rest;
  }
  return json;
}

}  // namespace wheelwright::results

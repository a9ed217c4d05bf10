// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/choice_json.hpp>

#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <wheelwright/files/json_number.hpp>
#include <wheelwright/results/warrant_json.hpp>

namespace wheelwright {
namespace {

const char* name_of(Guarantee guarantee) {
  switch (guarantee) {
    case Guarantee::never: return "never";
    case Guarantee::hourly: return "hourly";
    case Guarantee::extrapolated: return "extrapolated";
  }
  return "";
}

Warrant warrant_of(Guarantee guarantee) {
  switch (guarantee) {
    case Guarantee::never: return Warrant::guaranteed;
    case Guarantee::hourly: return Warrant::statistical;
    case Guarantee::extrapolated: return Warrant::extrapolated;
  }
  return Warrant::extrapolated;
}

Json filter_json(const FilterDesign& filter) {
  return {{"order", filter.order}, {"alpha", filter.alpha}, {"beta", filter.beta}};
}

Json candidate_json(const DetectorCandidate& candidate) {
  Json faults = Json::array();
  for (const StatedMargin& margin : candidate.faults) {
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
          {"warrant", warrant_word(warrant_of(candidate.guarantee))},
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

Json to_json(const DetectorChoice& choice, const std::string& robot, const std::vector<std::string>& logs,
             const std::string& software) {
  Json candidates = Json::array();
  for (const DetectorCandidate& candidate : choice.candidates) {
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

}  // namespace wheelwright

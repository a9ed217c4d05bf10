// SPDX-License-Identifier: Apache-2.0
#include "results/choice_json.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "formats/files/json.hpp"
#include "results/words/detect_words.hpp"

namespace wheelwright::results {

using commission::Guarantee;
using files::or_null;

using namespace words;

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
                         {"at_risk_from", from ? Json(*from) : Json(nullptr)}});
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

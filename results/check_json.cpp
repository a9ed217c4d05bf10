// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/check_json.hpp>

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <wheelwright/commission/physical.hpp>
#include <wheelwright/results/model_json.hpp>
#include <wheelwright/results/model_words.hpp>

namespace wheelwright::results {

std::string proof_scope(const ModelClaims& claims) {
  const auto tested =
      std::ranges::count(claims.assumptions, core::AssumptionVerdict::holds, &core::Assumption::verdict);
  return fmt::format(
      "What is proved is arithmetic: the bounds follow from the rows of the log within the stated noise. "
      "That the assumptions hold is not proved{}. The bounds are {}.",
      claims.assumptions.empty() ? ", and the model does not list them"
                                 : fmt::format(": commissioning took {}, of which {} were tested on the log and held",
                                               claims.assumptions.size(), tested),
      core::warrant_word(claims.warrant));
}

std::string verdict(const ModelCheck& check, const ModelClaims& claims) {
  if (!check.proved()) {
    return fmt::format("not proved: {} statement{} of the model {} not follow from the log", check.failures.size(),
                       check.failures.size() == 1 ? "" : "s", check.failures.size() == 1 ? "does" : "do");
  }
  if (check.emptiness) {
    return fmt::format("proved: no parameters explain {} rows of the log within the stated noise",
                       claims.contradiction.size());
  }
  return fmt::format("proved: all {} bounds and {} facets follow from the rows of the log that they name",
                     check.bounds.size(), claims.facets.size());
}

Json to_json(const ModelCheck& check, const ModelClaims& claims, const logs::LogReport& data, const CheckedFiles& files,
             const std::string& software) {
  Json log_files = Json::array(), bounds = Json::array();
  for (const logs::LogFileReport& file : data.files) {
    log_files.push_back({{"path", file.path}, {"hash", file.hash}, {"bytes", file.bytes}, {"rows", file.rows}});
  }
  for (const BoundVerdict& each : check.bounds) {
    const model::Parameter& parameter = claims.model.parameters[each.parameter];
    bounds.push_back(
        {{"parameter", parameter.name},
         {"unit", commission::parameter_unit(claims.robot, parameter)},
         {"side", files::word_of(kSideWords, each.side)},
         {"stated", each.stated},
         {"shown", files::or_null(each.shown)},
         {"proved", each.proved},
         {"shortfall", files::or_null(each.shortfall)},
         {"rows", (each.side == bounds::Side::upper ? claims.upper : claims.lower)[each.parameter].proof.size()},
         {"reason", each.reason}});
  }
  const FacetVerdicts& facets = check.facets;
  Json json = {
      {"schema", "wheelwright/check/1"},
      {"software", software},
      {"model", files.model},
      {"proved", check.proved()},
      {"message", verdict(check, claims)},
      {"warrant", core::warrant_word(claims.warrant)},
      {"scope", proof_scope(claims)},
      {"data", {{"same", check.same_log}, {"rows", data.rows}, {"segments", data.segments}, {"files", log_files}}},
      {"bounds", bounds},
      {"facets",
       {{"stated", claims.facets.size()},
        {"rows", facets.rows},
        {"sides", facets.sides},
        {"implied", facets.implied},
        {"wrong", facets.wrong.size()}}},
      {"failures", check.failures},
      {"warnings", check.warnings},
      {"premises", check.premises},
      {"assumptions", assumptions_json(claims.assumptions)}};
  if (check.emptiness) {
    json["contradiction"] = {{"rows", claims.contradiction.size()},
                             {"proved", check.emptiness->proved},
                             {"shortfall", files::or_null(check.emptiness->shortfall)}};
  }
  return json;
}

}  // namespace wheelwright::results

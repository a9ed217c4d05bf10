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

std::string risk_verdict(const RiskCheck& check, const RiskClaims& claims) {
  if (!check.failures.empty()) {
    return fmt::format("at a risk of {:g}: not proved, {} statement{} not follow from the log", claims.model.risk,
                       check.failures.size(), check.failures.size() == 1 ? " does" : "s do");
  }
  return fmt::format(
      "at a risk of {:g}: all {} bounds and {} facets follow from the guaranteed set and from {} sums over the log, "
      "and "
      "the risks of all {} ellipsoids add up to {:g}",
      claims.model.risk, check.bounds.size(), claims.model.facets.size(), claims.sums.size(), claims.ellipsoids.size(),
      check.spent);
}

namespace {

Json bound_json(const BoundVerdict& verdict, const ModelClaims& claims, std::size_t rows) {
  const model::Parameter& parameter = claims.model.parameters[verdict.parameter];
  return {{"parameter", parameter.name},
          {"unit", commission::parameter_unit(claims.robot, parameter)},
          {"side", files::word_of(kSideWords, verdict.side)},
          {"stated", verdict.stated},
          {"shown", files::or_null(verdict.shown)},
          {"proved", verdict.proved},
          {"shortfall", files::or_null(verdict.shortfall)},
          {"rows", rows},
          {"reason", verdict.reason}};
}

Json risk_json(const RiskCheck& check, const ModelClaims& claims) {
  const RiskClaims& risk = *claims.at_risk;
  Json bounds = Json::array();
  for (const BoundVerdict& each : check.bounds) {
    const auto& proofs = each.side == bounds::Side::upper ? risk.upper : risk.lower;
    bounds.push_back(bound_json(each, claims, proofs[each.parameter].size()));
  }
  return {{"risk", risk.model.risk},
          {"proved", check.failures.empty()},
          {"message", risk_verdict(check, risk)},
          {"spent", files::or_null(check.spent)},
          {"ellipsoids", risk.ellipsoids.size()},
          {"sums", {{"stated", risk.sums.size()}, {"proved", check.sums}}},
          {"facets", {{"stated", risk.model.facets.size()}, {"proved", check.facets}}},
          {"bounds", std::move(bounds)}};
}

}  // namespace

Json to_json(const ModelCheck& check, const ModelClaims& claims, const logs::LogReport& data, const CheckedFiles& files,
             const std::string& software) {
  Json log_files = Json::array(), bounds = Json::array();
  for (const logs::LogFileReport& file : data.files) {
    log_files.push_back({{"path", file.path}, {"hash", file.hash}, {"bytes", file.bytes}, {"rows", file.rows}});
  }
  for (const BoundVerdict& each : check.bounds) {
    const auto& stated = each.side == bounds::Side::upper ? claims.upper : claims.lower;
    bounds.push_back(bound_json(each, claims, stated[each.parameter].proof.size()));
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
  if (check.at_risk) {
    json["at_risk"] = risk_json(*check.at_risk, claims);
  }
  if (check.emptiness) {
    json["contradiction"] = {{"rows", claims.contradiction.size()},
                             {"proved", check.emptiness->proved},
                             {"shortfall", files::or_null(check.emptiness->shortfall)}};
  }
  return json;
}

}  // namespace wheelwright::results

// SPDX-License-Identifier: Apache-2.0
#include "app/check_report.hpp"

#include <fmt/format.h>

#include "results/check_words.hpp"
#include "results/report/page.hpp"
#include "results/report/sections.hpp"
#include "results/words/text.hpp"

namespace wheelwright::app {
using namespace words;

std::string check_report(const results::ModelCheck& check, const results::ModelClaims& claims,
                         const results::CheckedFiles& files, const std::string& software) {
  using namespace report;
  const auto bounds_table = [&](const std::vector<results::BoundVerdict>& verdicts, const results::SetClaims& set,
                                const std::vector<std::string>& units, const auto& origin) {
    std::vector<std::vector<Cell>> rows;
    for (const results::BoundVerdict& each : verdicts) {
      const std::string unit = unit_of(units[each.parameter]);
      rows.push_back({escape(spaced(set.parameter_names[each.parameter])),
                      each.side == bounds::Side::upper ? "at most" : "at least",
                      numeric(escape(unit.empty() ? fmt::format("{:.7g}", each.stated)
                                                  : with_unit(fmt::format("{:.7g}", each.stated), unit))),
                      each.proved ? "proved" : "not proved", escape(origin(each))});
    }
    return table({"parameter", "", numeric("bound"), "", "stands on"}, rows);
  };
  const std::vector<std::string> units = results::units_of(claims);
  PageContent content;
  content.title = "Check of the model of " + claims.robot.name;
  content.status = check.proved() ? (check.warnings.empty() ? "good" : "caution") : "bad";
  content.verdict = core::capital(results::verdict(check, claims)) + ".";
  content.sentences = {
      "Every proof was evaluated in exact rational arithmetic on rows that were filtered again from the log, without "
      "the "
      "solver that found them.",
      results::proof_scope(claims)};
  content.warrant = claims.warrant;
  content.sections = {
      {"bounds", "Bounds", bounds_table(check.bounds, claims, units, [&](const results::BoundVerdict& each) {
         return results::stands_on(each, claims);
       })}};
  if (!check.emptiness) {
    content.sections.push_back(
        {"facets", "Feasible set", paragraph(escape(core::capital(results::facet_sentence(check.facets)) + "."))});
  }
  if (check.at_risk) {
    const results::RiskClaims& risk = *claims.at_risk;
    const auto origin = [&](const results::BoundVerdict& each) { return results::stands_on_at_risk(each, risk); };
    content.sections.push_back({"at_risk", "At a stated risk",
                                paragraph(escape(core::capital(results::risk_verdict(*check.at_risk, risk)) + ".")) +
                                    bounds_table(check.at_risk->bounds, claims, units, origin)});
  }
  if (check.kinematic) {
    const results::KinematicClaims& kinematic = *claims.kinematic;
    content.sections.push_back(
        {"kinematic", "Wheel radii and yaw gains",
         paragraph(escape(core::capital(results::kinematic_verdict(*check.kinematic, kinematic)) + ".")) +
             bounds_table(check.kinematic->bounds, kinematic, kinematic.model.measurement.parameter_units(),
                          [&](const results::BoundVerdict& each) { return results::stands_on(each, kinematic); })});
    if (check.pose_at_risk) {
      content.sections.push_back(
          {"pose_at_risk", "Wheel radii and yaw gains at a stated risk",
           paragraph(escape(core::capital(results::pose_risk_verdict(*check.pose_at_risk, kinematic)) + ".")) +
               bounds_table(
                   check.pose_at_risk->bounds, *kinematic.at_risk, kinematic.model.measurement.parameter_units(),
                   [&](const results::BoundVerdict& each) { return results::stands_on_sums(each, kinematic); })});
    }
  }
  if (!check.failures.empty()) {
    content.sections.push_back({"failures", "Not proved", bullets(check.failures)});
  }
  if (!check.warnings.empty()) {
    content.sections.push_back({"warnings", "Warnings", bullets(check.warnings)});
  }
  content.sections.push_back({"premises", "Given, not proved", bullets(check.premises)});
  if (std::string given = assumptions_section(claims.assumptions); !given.empty()) {
    content.sections.push_back({"assumptions", "Assumptions", std::move(given)});
  }
  content.sections.push_back(
      {"files", "Files",
       definitions({{"model", files.model}, {"log", fmt::format("{}", fmt::join(files.logs, ", "))}})});
  content.software = software;
  return page(content);
}

}  // namespace wheelwright::app

// SPDX-License-Identifier: Apache-2.0
#include "check_report.hpp"

#include <algorithm>
#include <functional>
#include <set>

#include <fmt/format.h>

#include <wheelwright/commission/physical.hpp>
#include <wheelwright/report/page.hpp>
#include <wheelwright/report/sections.hpp>
#include <wheelwright/results/model_json.hpp>
#include <wheelwright/words/text.hpp>

namespace wheelwright::app {
using namespace words;
namespace {

const results::PublishedBound& claim_of(const results::BoundVerdict& verdict, const results::SetClaims& claims) {
  return (verdict.side == bounds::Side::upper ? claims.upper : claims.lower)[verdict.parameter];
}

/// "rows 5017, 8211 and the prior"; "the prior" where there is no row.
std::string stands_on(const results::BoundVerdict& verdict, const results::SetClaims& claims) {
  std::vector<std::size_t> rows;
  bool prior = false;
  for (const results::NamedRow& row : claim_of(verdict, claims).proof) {
    prior = prior || row.origin.is_prior;
    if (!row.origin.is_prior) {
      rows.push_back(row.origin.sample);
    }
  }
  if (rows.empty()) {
    return "the prior";
  }
  return fmt::format("row{} {}{}", rows.size() == 1 ? "" : "s", fmt::join(rows, ", "), prior ? " and the prior" : "");
}

/// "sums 0, 3 and the guaranteed set".
std::string stands_on_at_risk(const results::BoundVerdict& verdict, const results::RiskClaims& risk) {
  using Kind = commission::RiskOrigin::Kind;
  std::set<std::size_t> sums;
  bool guaranteed = false;
  for (const results::NamedRiskRow& row :
       (verdict.side == bounds::Side::upper ? risk.upper : risk.lower)[verdict.parameter]) {
    guaranteed = guaranteed || row.origin.kind != Kind::sum;
    if (row.origin.kind == Kind::sum) {
      sums.insert(row.origin.number);
    }
  }
  if (sums.empty()) {
    return "the guaranteed set";
  }
  return fmt::format("sum{} {}{}", sums.size() == 1 ? "" : "s", fmt::join(sums, ", "),
                     guaranteed ? " and the guaranteed set" : "");
}

/// "sums at 23.4 and 60.1 s and the guaranteed set".
std::string stands_on_sums(const results::BoundVerdict& verdict, const results::KinematicClaims& claims) {
  std::vector<std::string> times;
  bool guaranteed = false;
  for (const results::NamedRow& row : claim_of(verdict, *claims.at_risk).proof) {
    const bool sum = !row.origin.is_prior && row.origin.sample >= claims.facets.size();
    guaranteed = guaranteed || !sum;
    if (sum) {
      times.push_back(fmt::format("{:.6g}", row.origin.t));
    }
  }
  return times.empty() ? "the guaranteed set"
                       : fmt::format("sum{} at {} s{}", times.size() == 1 ? "" : "s", core::enumerated(times),
                                     guaranteed ? " and the guaranteed set" : "");
}

// "1" is no unit to be read.
std::string shown_unit(const std::string& unit) { return unit == "1" ? "" : unit; }

std::vector<std::string> units_of(const results::ModelClaims& claims) {
  std::vector<std::string> units;
  for (const model::Parameter& parameter : claims.model.parameters) {
    units.push_back(commission::parameter_unit(claims.robot, parameter));
  }
  return units;
}

// A line for each bound.
std::string bound_lines(const std::vector<results::BoundVerdict>& verdicts, const results::SetClaims& claims,
                        const std::vector<std::string>& units,
                        const std::function<std::string(const results::BoundVerdict&)>& stands) {
  constexpr int width = 44;
  std::string text;
  for (const results::BoundVerdict& each : verdicts) {
    const std::string statement =
        fmt::format("{} {} {:.7g} {}", claims.parameter_names[each.parameter],
                    each.side == bounds::Side::upper ? "<=" : ">=", each.stated, shown_unit(units[each.parameter]));
    text +=
        fmt::format("  {:<{}} {:<10}   {}\n", statement, width, each.proved ? "proved" : "NOT PROVED", stands(each));
  }
  return text;
}

std::string facet_sentence(const results::FacetVerdicts& facets) {
  const std::size_t all = facets.rows + facets.sides + facets.implied + facets.wrong.size();
  std::string text = fmt::format("{} of {} facets are what they name: {} rows of the log, {} sides of the prior",
                                 all - facets.wrong.size(), all, facets.rows, facets.sides);
  if (facets.implied > 0) {
    text += fmt::format(", {} that follow from the row named", facets.implied);
  }
  return text;
}

}  // namespace

std::string check_summary(const results::ModelCheck& check, const results::ModelClaims& claims) {
  constexpr std::size_t most = 12;
  std::string text = fmt::format("{}: {}\n", claims.robot.name, results::verdict(check, claims));
  if (check.emptiness) {
    text += fmt::format("  contradiction of {} rows: {}\n", claims.contradiction.size(),
                        check.emptiness->proved ? "proved" : "NOT PROVED");
  } else {
    const std::vector<std::string> units = units_of(claims);
    text += fmt::format("  {:<44} {:<10}   stands on\n", "bound", "");
    text += bound_lines(check.bounds, claims, units,
                        [&](const results::BoundVerdict& each) { return stands_on(each, claims); });
    text += "  " + facet_sentence(check.facets) + "\n";
    if (check.at_risk) {
      text += "  " + results::risk_verdict(*check.at_risk, *claims.at_risk) + "\n";
      text += bound_lines(check.at_risk->bounds, claims, units,
                          [&](const results::BoundVerdict& each) { return stands_on_at_risk(each, *claims.at_risk); });
    }
  }
  if (check.kinematic) {
    const results::KinematicClaims& kinematic = *claims.kinematic;
    text += "  " + results::kinematic_verdict(*check.kinematic, kinematic) + "\n";
    text += bound_lines(check.kinematic->bounds, kinematic, kinematic.model.measurement.parameter_units(),
                        [&](const results::BoundVerdict& each) { return stands_on(each, kinematic); });
    if (check.pose_at_risk) {
      text += "  " + results::pose_risk_verdict(*check.pose_at_risk, kinematic) + "\n";
      text += bound_lines(check.pose_at_risk->bounds, *kinematic.at_risk, kinematic.model.measurement.parameter_units(),
                          [&](const results::BoundVerdict& each) { return stands_on_sums(each, kinematic); });
    }
  }
  for (std::size_t k = 0; k < std::min(check.failures.size(), most); ++k) {
    text += "  failure: " + check.failures[k] + "\n";
  }
  if (check.failures.size() > most) {
    text += fmt::format("  … and {} more (--json lists them all)\n", check.failures.size() - most);
  }
  for (const std::string& warning : check.warnings) {
    text += "  warning: " + warning + "\n";
  }
  for (const std::string& premise : check.premises) {
    text += "  given: " + premise + "\n";
  }
  text += "  " + results::proof_scope(claims) + "\n";
  for (const core::Assumption& a : claims.assumptions) {
    text += fmt::format("  assumed ({}): {}\n", core::verdict_word(a.verdict), a.statement);
  }
  return text;
}

std::string check_report(const results::ModelCheck& check, const results::ModelClaims& claims,
                         const results::CheckedFiles& files, const std::string& software) {
  using namespace report;
  const auto bounds_table = [&](const std::vector<results::BoundVerdict>& verdicts, const results::SetClaims& set,
                                const std::vector<std::string>& units, const auto& origin) {
    std::vector<std::vector<Cell>> rows;
    for (const results::BoundVerdict& each : verdicts) {
      const std::string unit = shown_unit(units[each.parameter]);
      rows.push_back({escape(spaced(set.parameter_names[each.parameter])),
                      each.side == bounds::Side::upper ? "at most" : "at least",
                      numeric(escape(unit.empty() ? fmt::format("{:.7g}", each.stated)
                                                  : with_unit(fmt::format("{:.7g}", each.stated), unit))),
                      each.proved ? "proved" : "not proved", escape(origin(each))});
    }
    return table({"parameter", "", numeric("bound"), "", "stands on"}, rows);
  };
  const std::vector<std::string> units = units_of(claims);
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
  content.sections = {{"bounds", "Bounds",
                       bounds_table(check.bounds, claims, units,
                                    [&](const results::BoundVerdict& each) { return stands_on(each, claims); })}};
  if (!check.emptiness) {
    content.sections.push_back(
        {"facets", "Feasible set", paragraph(escape(core::capital(facet_sentence(check.facets)) + "."))});
  }
  if (check.at_risk) {
    const results::RiskClaims& risk = *claims.at_risk;
    const auto origin = [&](const results::BoundVerdict& each) { return stands_on_at_risk(each, risk); };
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
                          [&](const results::BoundVerdict& each) { return stands_on(each, kinematic); })});
    if (check.pose_at_risk) {
      content.sections.push_back(
          {"pose_at_risk", "Wheel radii and yaw gains at a stated risk",
           paragraph(escape(core::capital(results::pose_risk_verdict(*check.pose_at_risk, kinematic)) + ".")) +
               bounds_table(check.pose_at_risk->bounds, *kinematic.at_risk,
                            kinematic.model.measurement.parameter_units(),
                            [&](const results::BoundVerdict& each) { return stands_on_sums(each, kinematic); })});
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

// SPDX-License-Identifier: Apache-2.0
#include "results/check_words.hpp"

#include <algorithm>
#include <functional>
#include <set>

#include <fmt/format.h>

#include "commission/physical.hpp"
#include "results/words/text.hpp"

namespace wheelwright::results {
namespace {

const PublishedBound& claim_of(const BoundVerdict& verdict, const SetClaims& claims) {
  return (verdict.side == bounds::Side::upper ? claims.upper : claims.lower)[verdict.parameter];
}

// A line for each bound.
std::string bound_lines(const std::vector<BoundVerdict>& verdicts, const SetClaims& claims,
                        const std::vector<std::string>& units,
                        const std::function<std::string(const BoundVerdict&)>& stands) {
  constexpr int width = 44;
  std::string text;
  for (const BoundVerdict& each : verdicts) {
    const std::string statement =
        fmt::format("{} {} {:.7g} {}", claims.parameter_names[each.parameter],
                    each.side == bounds::Side::upper ? "<=" : ">=", each.stated, words::unit_of(units[each.parameter]));
    text +=
        fmt::format("  {:<{}} {:<10}   {}\n", statement, width, each.proved ? "proved" : "NOT PROVED", stands(each));
  }
  return text;
}

}  // namespace

std::string stands_on(const BoundVerdict& verdict, const SetClaims& claims) {
  std::vector<std::size_t> rows;
  bool prior = false;
  for (const NamedRow& row : claim_of(verdict, claims).proof) {
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

std::string stands_on_at_risk(const BoundVerdict& verdict, const RiskClaims& risk) {
  using Kind = commission::RiskOrigin::Kind;
  std::set<std::size_t> sums;
  bool guaranteed = false;
  for (const NamedRiskRow& row : (verdict.side == bounds::Side::upper ? risk.upper : risk.lower)[verdict.parameter]) {
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

std::string stands_on_sums(const BoundVerdict& verdict, const KinematicClaims& claims) {
  std::vector<std::string> times;
  bool guaranteed = false;
  for (const NamedRow& row : claim_of(verdict, *claims.at_risk).proof) {
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

std::vector<std::string> units_of(const ModelClaims& claims) {
  std::vector<std::string> units;
  for (const model::Parameter& parameter : claims.model.parameters) {
    units.push_back(commission::parameter_unit(claims.robot, parameter));
  }
  return units;
}

std::string facet_sentence(const FacetVerdicts& facets) {
  const std::size_t all = facets.rows + facets.sides + facets.implied + facets.wrong.size();
  std::string text = fmt::format("{} of {} facets are what they name: {} rows of the log, {} sides of the prior",
                                 all - facets.wrong.size(), all, facets.rows, facets.sides);
  if (facets.implied > 0) {
    text += fmt::format(", {} that follow from the row named", facets.implied);
  }
  return text;
}

std::string check_summary(const ModelCheck& check, const ModelClaims& claims) {
  constexpr std::size_t most = 12;
  std::string text = fmt::format("{}: {}\n", claims.robot.name, verdict(check, claims));
  if (check.emptiness) {
    text += fmt::format("  contradiction of {} rows: {}\n", claims.contradiction.size(),
                        check.emptiness->proved ? "proved" : "NOT PROVED");
  } else {
    const std::vector<std::string> units = units_of(claims);
    text += fmt::format("  {:<44} {:<10}   stands on\n", "bound", "");
    text += bound_lines(check.bounds, claims, units, [&](const BoundVerdict& each) { return stands_on(each, claims); });
    text += "  " + facet_sentence(check.facets) + "\n";
    if (check.at_risk) {
      text += "  " + risk_verdict(*check.at_risk, *claims.at_risk) + "\n";
      text += bound_lines(check.at_risk->bounds, claims, units,
                          [&](const BoundVerdict& each) { return stands_on_at_risk(each, *claims.at_risk); });
    }
  }
  if (check.kinematic) {
    const KinematicClaims& kinematic = *claims.kinematic;
    text += "  " + kinematic_verdict(*check.kinematic, kinematic) + "\n";
    text += bound_lines(check.kinematic->bounds, kinematic, kinematic.model.measurement.parameter_units(),
                        [&](const BoundVerdict& each) { return stands_on(each, kinematic); });
    if (check.pose_at_risk) {
      text += "  " + pose_risk_verdict(*check.pose_at_risk, kinematic) + "\n";
      text += bound_lines(check.pose_at_risk->bounds, *kinematic.at_risk, kinematic.model.measurement.parameter_units(),
                          [&](const BoundVerdict& each) { return stands_on_sums(each, kinematic); });
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
  text += "  " + proof_scope(claims) + "\n";
  for (const core::Assumption& a : claims.assumptions) {
    text += fmt::format("  assumed ({}): {}\n", core::verdict_word(a.verdict), a.statement);
  }
  return text;
}

}  // namespace wheelwright::results

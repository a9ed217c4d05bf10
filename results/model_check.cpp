// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/model_check.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/commission/physical.hpp>

#include <wheelwright/results/rebuilt_rows.hpp>
#include <wheelwright/results/risk_check.hpp>

namespace wheelwright::results {
namespace {

/// The bounds proved, the boxes over which rows were built, and what could not be built.
struct Proof {
  bounds::HullCheck hull;
  std::vector<Box> boxes;  // the prior, and those proved on the way
  std::vector<std::string> missing_lower, missing_upper;
};

/// Claims over the prior; where rows depend on signs that this proves, again over what was proved.
Proof prove_bounds(const ModelClaims& claims, const RebuiltRows& rebuilt) {
  const std::size_t p = claims.model.p();
  Proof proof;
  Box box = claims.prior;
  while (true) {
    proof.boxes.push_back(box);
    std::vector<bounds::BoundClaim> lower, upper;
    proof.missing_lower.assign(p, {});
    proof.missing_upper.assign(p, {});
    for (std::size_t j = 0; j < p; ++j) {
      lower.push_back({claims.lower[j].value, rebuilt.proof(claims.lower[j].proof, box, proof.missing_lower[j])});
      upper.push_back({claims.upper[j].value, rebuilt.proof(claims.upper[j].proof, box, proof.missing_upper[j])});
    }
    proof.hull = bounds::check_hull(lower, upper, box);
    if (proof.hull.contradiction || proof.hull.all_proved() || proof.hull.proved == box || !rebuilt.depends_on(box) ||
        proof.boxes.size() > 8) {
      return proof;
    }
    box = proof.hull.proved;
  }
}

std::string sign_parts_remark(const ModelClaims& claims) {
  return claims.sign_parts > 1 ? fmt::format(
                                     "; the set is a union of {} parts, one for each pattern of open signs, and "
                                     "a model file proves the bounds of one part only",
                                     claims.sign_parts)
                               : std::string();
}

/// Why a proof is none, with the names of rows and parameters.
std::string explain(const bounds::CertificateCheck& check, const std::string& missing,
                    const std::vector<NamedRow>& proof, const ModelClaims& claims) {
  if (!missing.empty()) {
    return missing;
  }
  const auto name = [&](std::size_t row) { return name_of(proof[row].origin, claims.model); };
  return shortcoming(check, name, claims.model) + sign_parts_remark(claims);
}

void judge_bounds(const ModelClaims& claims, const Proof& proof, ModelCheck& result) {
  for (std::size_t j = 0; j < claims.model.p(); ++j) {
    for (const bounds::Side side : {bounds::Side::lower, bounds::Side::upper}) {
      const bool is_upper = side == bounds::Side::upper;
      const PublishedBound& claim = (is_upper ? claims.upper : claims.lower)[j];
      const bounds::CertificateCheck& check = (is_upper ? proof.hull.upper : proof.hull.lower)[j];
      const std::string& missing = (is_upper ? proof.missing_upper : proof.missing_lower)[j];
      BoundVerdict verdict{j, side, claim.value, is_upper ? check.bound : -check.bound, check.proved, check.shortfall,
                           {}};
      if (!check.proved || !missing.empty()) {
        verdict.proved = false;
        verdict.reason = explain(check, missing, claim.proof, claims);
        result.failures.push_back(fmt::format("{} {} {} is not proved: {}", claims.model.parameters[j].name,
                                              is_upper ? "<=" : ">=", claim.value, verdict.reason));
      }
      result.bounds.push_back(std::move(verdict));
    }
  }
  if (proof.hull.contradiction) {
    result.failures.push_back(
        "the rows that are to prove the bounds contradict each other: they prove that no parameters explain the log, "
        "and the model says that some do");
  }
}

void judge_hull(const ModelClaims& claims, const Proof& proof, ModelCheck& result) {
  const auto scales = commission::physical_scales(claims.robot, claims.model);
  for (std::size_t j = 0; j < claims.model.p(); ++j) {
    const Interval& proved = proof.hull.proved.sides[j];
    const Interval& hull = claims.hull.sides[j];
    const model::Parameter& parameter = claims.model.parameters[j];
    // A hull that is the stated bounds was judged with them.
    const bool other = hull.lower != claims.lower[j].value || hull.upper != claims.upper[j].value;
    if (other && !(hull.lower <= proved.lower && proved.upper <= hull.upper)) {
      result.failures.push_back(
          fmt::format("feasible_set.hull of {}, [{}, {}], does not contain what is proved, [{}, {}]", parameter.name,
                      hull.lower, hull.upper, proved.lower, proved.upper));
    }
    if (const auto stated = claims.physical.find(parameter.physical); stated != claims.physical.end() && scales) {
      const commission::PhysicalScale& s = (*scales)[j];
      const Interval exact = Interval{s.scale, s.scale} * Interval{claims.lower[j].value, claims.upper[j].value} -
                             Interval{s.offset, s.offset};
      if (!(stated->second.lower <= exact.lower && exact.upper <= stated->second.upper)) {
        result.failures.push_back(
            fmt::format("the physical {}, [{}, {}], does not contain what its bounds mean, [{}, {}]",
                        parameter.physical, stated->second.lower, stated->second.upper, exact.lower, exact.upper));
      }
    }
  }
}

/// Whether the facet is the row that it names or follows from it; otherwise a sentence.
std::string judge_facet(const bounds::HalfSpace& facet, const RebuiltRows& rebuilt, const Proof& proof,
                        const ModelClaims& claims, FacetVerdicts& verdicts) {
  const std::span<const double> a(facet.a.data(), static_cast<std::size_t>(facet.a.size()));
  const Box& within = proof.hull.contradiction ? claims.prior : proof.hull.proved;
  std::string why;
  for (const Box& box : proof.boxes) {
    std::string missing;
    const auto row = rebuilt.row(facet.origin, box, missing);
    if (!row) {
      return missing;
    }
    const bool same = row->a == facet.a;
    if (same && row->b <= facet.b) {
      ++(facet.origin.is_prior ? verdicts.sides : verdicts.rows);
      return {};
    }
    const std::vector<bounds::WeightedRow> alone{{*row, 1.0}};
    const bounds::CertificateCheck check = bounds::check_bound(a, alone, within, facet.b);
    if (check.proved) {
      ++verdicts.implied;
      return {};
    }
    why = same ? fmt::format("its b is inward of {} by {:.3g}", name_of(facet.origin, claims.model), row->b - facet.b)
               : fmt::format("its coefficients are not those of {}, from which it does not follow by {:.3g}",
                             name_of(facet.origin, claims.model), check.shortfall);
  }
  return why + sign_parts_remark(claims);
}

/// Says of each facet whether it is proved.
std::vector<bool> judge_facets(const ModelClaims& claims, const RebuiltRows& rebuilt, const Proof& proof,
                               ModelCheck& result) {
  std::vector<bool> proved(claims.facets.size(), true);
  for (std::size_t k = 0; k < claims.facets.size(); ++k) {
    if (const std::string why = judge_facet(claims.facets[k], rebuilt, proof, claims, result.facets); !why.empty()) {
      result.facets.wrong.push_back(fmt::format("row {} of feasible_set.A is not proved: {}", k, why));
      proved[k] = false;
    }
  }
  result.failures.insert(result.failures.end(), result.facets.wrong.begin(), result.facets.wrong.end());
  return proved;
}

void judge_emptiness(const ModelClaims& claims, const RebuiltRows& rebuilt, ModelCheck& result) {
  std::string missing;
  const std::vector<bounds::WeightedRow> rows = rebuilt.proof(claims.contradiction, claims.prior, missing);
  result.emptiness = bounds::check_emptiness(rows, claims.prior);
  if (!result.emptiness->proved || !missing.empty()) {
    result.emptiness->proved = false;
    result.failures.push_back("that no parameters explain the log is not proved: " +
                              explain(*result.emptiness, missing, claims.contradiction, claims));
  }
}

void judge_log(const ModelClaims& claims, const logs::LogReport& data, ModelCheck& result) {
  result.same_log =
      std::ranges::equal(claims.files, data.files, {}, &logs::LogFileReport::hash, &logs::LogFileReport::hash);
  if (result.same_log && data.rows == claims.rows && data.segments == claims.segments) {
    return;
  }
  const auto names = [](const std::vector<logs::LogFileReport>& files) {
    std::string text;
    for (const logs::LogFileReport& file : files) {
      text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", file.path, file.hash);
    }
    return text;
  };
  const std::string differs =
      fmt::format("{} is not the log that was commissioned, {}", names(data.files), names(claims.files));
  if (data.rows != claims.rows || data.segments != claims.segments) {
    result.failures.push_back(fmt::format("{}: it has {} usable rows (segments: {}), not {} ({})", differs, data.rows,
                                          data.segments, claims.rows, claims.segments));
  } else {
    result.warnings.push_back(differs + ", byte by byte; it has as many rows, and what is proved here holds for it");
  }
}

void judge_prior(const ModelClaims& claims, ModelCheck& result) {
  const model::PriorBox known = model::prior_box(claims.robot, claims.model);
  for (std::size_t j = 0; j < claims.model.p(); ++j) {
    const Interval& stated = claims.prior.sides[j];
    if (known.bounds[j].lower < stated.lower || stated.upper < known.bounds[j].upper) {
      auto& list = known.declared[j] ? result.failures : result.warnings;
      list.push_back(fmt::format("the prior of {}, [{}, {}], is narrower than {}, [{}, {}]",
                                 claims.model.parameters[j].name, stated.lower, stated.upper,
                                 known.declared[j] ? "the robot's" : "the default of this version",
                                 known.bounds[j].lower, known.bounds[j].upper));
    }
  }
}

void tell_premises(const ModelClaims& claims, ModelCheck& result) {
  result.premises.push_back(
      "the prior box, the filter, the measurement and the errors of the motion that the model states");
  for (std::size_t i = 0; i < claims.model.n(); ++i) {
    result.premises.push_back(
        fmt::format("an error of at most {:.4g} {} in the filtered effort, {} channel ({})",
                    claims.errors.output[static_cast<Eigen::Index>(i)],
                    commission::output_unit(claims.robot, claims.model.output_units[i]), claims.model.outputs[i],
                    claims.origin[i] == core::NoiseOrigin::declared ? "from the declared bounds of the sensors"
                                                                    : "estimated from the residuals of this log"));
  }
  if (claims.at_risk) {
    result.premises.push_back(fmt::format(
        "at a risk of {:g}: that errors are as the robot file says and of no larger mean, independent from joint to "
        "joint; the inequality for their sums (docs/risk.md); that delays, shares of the risk, and the part of the log "
        "on which a scale is learnt, were chosen without this log; and how elements and sample weights are computed, "
        "which commissioning and this check have in common",
        claims.at_risk->model.risk));
  }
  if (!claims.dropped.empty()) {
    result.premises.push_back(
        fmt::format("that the instants left out as outliers (rows {}) are the wrong ones: this cannot be checked",
                    fmt::join(claims.dropped, ", ")));
  }
}

}  // namespace

std::string name_of(const bounds::RowOrigin& origin, const Model& model) {
  const char* side = origin.side == bounds::Side::upper ? "upper" : "lower";
  return origin.is_prior
             ? fmt::format("the prior's {} bound of {}", side, model.parameters[origin.parameter].name)
             : fmt::format("row {} (t = {} s, {}, {})", origin.sample, origin.t, model.outputs[origin.output], side);
}

std::string shortcoming(const bounds::CertificateCheck& check, const std::function<std::string(std::size_t)>& row_name,
                        const Model& model) {
  if (!std::isfinite(check.shortfall)) {
    return check.row ? fmt::format("{} ({})", check.reason, row_name(*check.row)) : check.reason;
  }
  std::string text = fmt::format("what the certificate proves falls short of it by {:.3g}", check.shortfall);
  if (check.row) {
    text += "; it proves more without " + row_name(*check.row);
  }
  if (check.parameter) {
    text += fmt::format("; most is left over in {}", model.parameters[*check.parameter].name);
  }
  return text;
}

ModelCheck check_model(const ModelClaims& claims, LogSource& log, const logs::LogReport& data) {
  ModelCheck result;
  judge_log(claims, data, result);
  judge_prior(claims, result);
  const RebuiltRows rebuilt(claims, log);
  const Proof proof = prove_bounds(claims, rebuilt);
  judge_bounds(claims, proof, result);
  if (claims.set == FeasibleSet::Status::empty) {
    judge_emptiness(claims, rebuilt, result);
    if (claims.at_risk) {
      result.failures.emplace_back("a set at a stated risk is a part of the guaranteed one, which is said to be empty");
    }
  } else {
    if (!proof.hull.contradiction) {
      judge_hull(claims, proof, result);
    }
    const std::vector<bool> facets = judge_facets(claims, rebuilt, proof, result);
    if (claims.at_risk && !proof.hull.contradiction) {
      result.at_risk = check_at_risk(claims, *claims.at_risk, log, proof.hull.proved, facets);
      result.failures.insert(result.failures.end(), result.at_risk->failures.begin(), result.at_risk->failures.end());
    }
  }
  tell_premises(claims, result);
  return result;
}

}  // namespace wheelwright::results

// SPDX-License-Identifier: Apache-2.0
#include "results/set_check.hpp"

#include <algorithm>
#include <cmath>
#include <set>
#include <span>
#include <utility>

#include <fmt/format.h>

#include "bounds/slab_rows.hpp"

namespace wheelwright::results {
namespace {

/// The instants that the claims name.
RegressionBlock named_instants(const SetClaims& claims, core::RegressionSource& rows) {
  std::set<std::size_t> wanted;
  const auto want = [&](const bounds::RowOrigin& origin) {
    if (!origin.is_prior) {
      wanted.insert(origin.sample);
    }
  };
  for (const auto* bounds : {&claims.lower, &claims.upper}) {
    for (const PublishedBound& bound : *bounds) {
      std::ranges::for_each(bound.proof, [&](const NamedRow& row) { want(row.origin); });
    }
  }
  std::ranges::for_each(claims.contradiction, [&](const NamedRow& row) { want(row.origin); });
  std::ranges::for_each(claims.facets, [&](const bounds::HalfSpace& facet) { want(facet.origin); });

  RegressionBlock kept;
  kept.resize(wanted.size(), claims.output_names.size(), claims.parameter_names.size());
  const auto n = static_cast<Eigen::Index>(claims.output_names.size());
  std::size_t count = 0;
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    for (std::size_t k = 0; k < block.instants(); ++k) {
      if (wanted.contains(block.sample[k])) {
        const auto to = static_cast<Eigen::Index>(count) * n, from = static_cast<Eigen::Index>(k) * n;
        kept.sample[count] = block.sample[k];
        kept.t[count++] = block.t[k];
        kept.Y.middleRows(to, n) = block.Y.middleRows(from, n);
        kept.dY.middleRows(to, n) = block.dY.middleRows(from, n);
        kept.y.segment(to, n) = block.y.segment(from, n);
        kept.dy.segment(to, n) = block.dy.segment(from, n);
      }
    }
  });
  kept.sample.resize(count);  // fewer than the storage holds where a name is no instant of this log
  kept.t.resize(count);
  return kept;
}

/// A side of the prior box.
bounds::HalfSpace side_of(const Box& prior, const bounds::RowOrigin& origin) {
  const Interval& side = prior.sides[origin.parameter];
  const bool is_upper = origin.side == bounds::Side::upper;
  bounds::HalfSpace row{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(prior.dimension())),
                        is_upper ? side.upper : -side.lower, origin};
  row.a[static_cast<Eigen::Index>(origin.parameter)] = is_upper ? 1.0 : -1.0;
  return row;
}

/// The rows that the claims name.
class RebuiltRows {
 public:
  /// Walks `rows` once; keeps the named instants only. `claims` must outlive it.
  RebuiltRows(const SetClaims& claims, core::RegressionSource& rows);

  /// True if a column is noisy and `box` leaves the sign of its parameter open: the rows then depend on the box.
  [[nodiscard]] bool depends_on(const Box& box) const;

  /// The half-space that holds for every admissible θ of `box` (SlabRows; sides are those of the prior). Nothing where
  /// this log has no such row, or one at another time, or where it was left out: `why` says which.
  [[nodiscard]] std::optional<bounds::HalfSpace> row(const bounds::RowOrigin& origin, const Box& box,
                                                     std::string& why) const;

  /// The rows of a proof, in their order. One that cannot be built takes no part (a multiplier of 0); the first of them
  /// is told in `why`.
  [[nodiscard]] std::vector<bounds::WeightedRow> proof(const std::vector<NamedRow>& named, const Box& box,
                                                       std::string& why) const;

 private:
  const SetClaims& claims_;
  RegressionBlock instants_;
};

RebuiltRows::RebuiltRows(const SetClaims& claims, core::RegressionSource& rows)
    : claims_(claims), instants_(named_instants(claims, rows)) {}

bool RebuiltRows::depends_on(const Box& box) const {
  const bounds::SlabRows slabs(box);
  for (std::size_t j = 0; j < box.dimension(); ++j) {
    const auto column = instants_.dY.col(static_cast<Eigen::Index>(j)).head(instants_.rows());
    if (slabs.sign_is_open(j) && (column.array() > 0.0).any()) {
      return true;
    }
  }
  return false;
}

std::optional<bounds::HalfSpace> RebuiltRows::row(const bounds::RowOrigin& origin, const Box& box,
                                                  std::string& why) const {
  if (origin.is_prior) {
    return side_of(claims_.prior, origin);
  }
  if (std::ranges::find(claims_.dropped, origin.sample) != claims_.dropped.end()) {
    why = fmt::format("row {} is one of those that were left out as outliers", origin.sample);
    return std::nullopt;
  }
  const auto it = std::ranges::lower_bound(instants_.sample, origin.sample);
  if (it == instants_.sample.end() || *it != origin.sample) {
    why = fmt::format("row {} is no instant of the regression of this log", origin.sample);
    return std::nullopt;
  }
  const auto k = static_cast<std::size_t>(it - instants_.sample.begin());
  if (instants_.t[k] != origin.t) {
    why = fmt::format("row {} is at t = {} s in this log, not at {} s", origin.sample, instants_.t[k], origin.t);
    return std::nullopt;
  }
  bounds::HalfSpace upper, lower;
  const auto row = static_cast<Eigen::Index>(k * instants_.outputs + origin.output);
  bounds::SlabRows(box).half_spaces(instants_, row, upper, lower);
  return origin.side == bounds::Side::upper ? upper : lower;
}

std::vector<bounds::WeightedRow> RebuiltRows::proof(const std::vector<NamedRow>& named, const Box& box,
                                                    std::string& why) const {
  std::vector<bounds::WeightedRow> rows;
  for (const NamedRow& name : named) {
    std::string missing;
    if (auto half_space = row(name.origin, box, missing)) {
      rows.push_back({*std::move(half_space), name.multiplier});
    } else {
      rows.push_back({{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(box.dimension())), 0.0, {}}, 0.0});
      why = why.empty() ? missing : why;
    }
  }
  return rows;
}

/// The bounds proved, the boxes over which rows were built, and what could not be built.
struct Proof {
  bounds::HullCheck hull;
  std::vector<Box> boxes;  // the prior, and those proved on the way
  std::vector<std::string> missing_lower, missing_upper;
};

/// Claims over the prior; where rows depend on signs that this proves, again over what was proved.
Proof prove_bounds(const SetClaims& claims, const RebuiltRows& rebuilt) {
  const std::size_t p = claims.parameter_names.size();
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

std::string sign_parts_remark(const SetClaims& claims) {
  return claims.sign_parts > 1 ? fmt::format(
                                     "; the set is a union of {} parts, one for each pattern of open signs, and "
                                     "a model file proves the bounds of one part only",
                                     claims.sign_parts)
                               : std::string();
}

/// Why a proof is none, with the names of rows and parameters.
std::string explain(const bounds::CertificateCheck& check, const std::string& missing,
                    const std::vector<NamedRow>& proof, const SetClaims& claims) {
  if (!missing.empty()) {
    return missing;
  }
  const auto name = [&](std::size_t row) { return name_of(proof[row].origin, claims); };
  return shortcoming(check, name, claims) + sign_parts_remark(claims);
}

void judge_bounds(const SetClaims& claims, const Proof& proof, SetCheck& result) {
  for (std::size_t j = 0; j < claims.parameter_names.size(); ++j) {
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
        result.failures.push_back(fmt::format("{} {} {} is not proved: {}", claims.parameter_names[j],
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

void judge_hull(const SetClaims& claims, const Box& least, SetCheck& result) {
  for (std::size_t j = 0; j < least.dimension(); ++j) {
    const Interval &proved = least.sides[j], &hull = claims.hull.sides[j];
    // A hull that is the stated bounds was judged with them.
    const bool other = hull.lower != claims.lower[j].value || hull.upper != claims.upper[j].value;
    if (other && !(hull.lower <= proved.lower && proved.upper <= hull.upper)) {
      result.failures.push_back(fmt::format("{}.hull of {}, [{}, {}], does not contain what is proved, [{}, {}]",
                                            claims.key, claims.parameter_names[j], hull.lower, hull.upper, proved.lower,
                                            proved.upper));
    }
  }
}

/// Whether the facet is the row that it names or follows from it; otherwise a sentence.
std::string judge_facet(const bounds::HalfSpace& facet, const RebuiltRows& rebuilt, const Proof& proof,
                        const SetClaims& claims, FacetVerdicts& verdicts) {
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
    why = same ? fmt::format("its b is inward of {} by {:.3g}", name_of(facet.origin, claims), row->b - facet.b)
               : fmt::format("its coefficients are not those of {}, from which it does not follow by {:.3g}",
                             name_of(facet.origin, claims), check.shortfall);
  }
  return why + sign_parts_remark(claims);
}

/// Says of each facet whether it is proved.
std::vector<bool> judge_facets(const SetClaims& claims, const RebuiltRows& rebuilt, const Proof& proof,
                               SetCheck& result) {
  std::vector<bool> proved(claims.facets.size(), true);
  for (std::size_t k = 0; k < claims.facets.size(); ++k) {
    if (const std::string why = judge_facet(claims.facets[k], rebuilt, proof, claims, result.facets); !why.empty()) {
      result.facets.wrong.push_back(fmt::format("row {} of {}.A is not proved: {}", k, claims.key, why));
      proved[k] = false;
    }
  }
  result.failures.insert(result.failures.end(), result.facets.wrong.begin(), result.facets.wrong.end());
  return proved;
}

void judge_emptiness(const SetClaims& claims, const RebuiltRows& rebuilt, SetCheck& result) {
  std::string missing;
  const std::vector<bounds::WeightedRow> rows = rebuilt.proof(claims.contradiction, claims.prior, missing);
  result.emptiness = bounds::check_emptiness(rows, claims.prior);
  if (!result.emptiness->proved || !missing.empty()) {
    result.emptiness->proved = false;
    result.failures.push_back("that no parameters explain the log is not proved: " +
                              explain(*result.emptiness, missing, claims.contradiction, claims));
  }
}

}  // namespace

std::string name_of(const bounds::RowOrigin& origin, const SetClaims& claims) {
  const char* side = origin.side == bounds::Side::upper ? "upper" : "lower";
  return origin.is_prior ? fmt::format("the prior's {} bound of {}", side, claims.parameter_names[origin.parameter])
                         : fmt::format("row {} (t = {} s, {}, {})", origin.sample, origin.t,
                                       claims.output_names[origin.output], side);
}

std::string shortcoming(const bounds::CertificateCheck& check, const std::function<std::string(std::size_t)>& row_name,
                        const SetClaims& claims) {
  if (!std::isfinite(check.shortfall)) {
    return check.row ? fmt::format("{} ({})", check.reason, row_name(*check.row)) : check.reason;
  }
  std::string text = fmt::format("what the certificate proves falls short of it by {:.3g}", check.shortfall);
  if (check.row) {
    text += "; it proves more without " + row_name(*check.row);
  }
  if (check.parameter) {
    text += fmt::format("; most is left over in {}", claims.parameter_names[*check.parameter]);
  }
  return text;
}

SetCheck check_set(const SetClaims& claims, core::RegressionSource& rows) {
  SetCheck result;
  const RebuiltRows rebuilt(claims, rows);
  const Proof proof = prove_bounds(claims, rebuilt);
  result.proved = proof.hull.proved;
  result.contradiction = proof.hull.contradiction;
  judge_bounds(claims, proof, result);
  if (claims.set == FeasibleSet::Status::empty) {
    judge_emptiness(claims, rebuilt, result);
    return result;
  }
  if (!result.contradiction) {
    judge_hull(claims, result.proved, result);
  }
  result.facet_proved = judge_facets(claims, rebuilt, proof, result);
  return result;
}

}  // namespace wheelwright::results

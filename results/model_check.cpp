// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/results/model_check.hpp>

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <wheelwright/bounds/slab_rows.hpp>
#include <wheelwright/commission/fit.hpp>
#include <wheelwright/commission/physical.hpp>
#include <wheelwright/filter/row_stream.hpp>
#include <wheelwright/results/model_json.hpp>
#include <wheelwright/results/risk_check.hpp>

namespace wheelwright::results {
namespace {

/// The instants of the log's regression that the claims name.
RegressionBlock named_instants(const ModelClaims& claims, LogSource& log) {
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

  RegressionBlock kept, block;
  kept.resize(wanted.size(), claims.model.n(), claims.model.p());
  const auto n = static_cast<Eigen::Index>(claims.model.n());
  std::size_t count = 0;
  TorqueRows rows(log, RegressorFilter(commission::without_columns(claims.model, claims.left_out), claims.filter,
                                       claims.measurement, claims.errors));
  while (rows.next(block)) {
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
  }
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

/// The rows of the log's regression that the claims of a model name, filtered again with the claimed filter and errors.
class RebuiltRows {
 public:
  /// Walks `log` once; keeps the named instants only. `claims` must outlive it. Throws InvalidArgument when the log
  /// lacks a column.
  RebuiltRows(const ModelClaims& claims, LogSource& log);

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
  const ModelClaims& claims_;
  RegressionBlock instants_;
};

RebuiltRows::RebuiltRows(const ModelClaims& claims, LogSource& log)
    : claims_(claims), instants_(named_instants(claims, log)) {}

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

/// Driving to come is watched with no smaller errors than those that the set is proved with. The motion between samples
/// is left out: commissioning bounds it for the log and for other driving by different means.
void judge_detector(const ModelClaims& claims, ModelCheck& result) {
  if (!claims.detector_errors) {
    return;
  }
  const filter::SignalErrors &watched = *claims.detector_errors, &proved = claims.errors;
  const auto judge = [&](const char* key, const auto& stated, const auto& least) {
    for (Eigen::Index i = 0; i < least.size(); ++i) {
      const double value = i < stated.size() ? stated[i] : 0.0;
      if (value < least[i]) {
        result.failures.push_back(
            fmt::format("detector.error_bounds.{}[{}] is {}: expected at least {}, the noise that the bounds are "
                        "proved with",
                        key, i, value, least[i]));
      }
    }
  };
  judge("output", watched.output, proved.output);
  judge("acceleration", watched.acceleration, proved.acceleration);
  judge("speed", watched.speed, proved.speed);
  judge("speed_sample", watched.speed_sample, proved.speed_sample);
  judge("joint_sample", Eigen::VectorXd::Constant(1, watched.joint_sample),
        Eigen::VectorXd::Constant(1, proved.joint_sample));
  judge("heading", Eigen::VectorXd::Constant(1, watched.heading), Eigen::VectorXd::Constant(1, proved.heading));
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
  for (std::size_t j = 0; j < claims.left_out.size(); ++j) {
    if (claims.left_out[j]) {
      result.premises.push_back(fmt::format("that what the log shows of {} is noise alone: its column was left out",
                                            claims.model.parameters[j].name));
    }
  }
  if (claims.at_risk) {
    const bool estimated = claims.at_risk->model.warrant == core::Warrant::extrapolated;
    result.premises.push_back(fmt::format(
        "at a risk of {:g}: that errors are as {} and of no larger mean, independent from joint to "
        "joint; the inequality for their sums (docs/risk.md); that delays, shares of the risk, and the part of the log "
        "on which a scale is learnt, were chosen without this log; and how elements and sample weights are computed, "
        "which commissioning and this check have in common",
        claims.at_risk->model.risk,
        estimated ? "they were estimated from the log, in all driving to come," : "the robot file says"));
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
  judge_detector(claims, result);
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

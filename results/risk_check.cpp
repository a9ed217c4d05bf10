// SPDX-License-Identifier: Apache-2.0
#include "results/risk_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "commission/noise_budget.hpp"
#include "commission/physical.hpp"
#include "core/limits.hpp"
#include "model/filter/sample_weights.hpp"
#include "results/model_json.hpp"

namespace wheelwright::results {
namespace {

using bounds::HalfSpace;
using commission::RiskEllipsoid;
using commission::RiskFacet;
using commission::RiskOrigin;

constexpr double kRounding = 1e-9;  // relative, of volumes and radii

/// The claims, and what the log makes of them.
struct Case {
  const ModelClaims& claims;
  const RiskClaims& risk;
  const std::vector<bool>& guaranteed;          // facets that are proved
  commission::RiskSums sums;                    // of the log
  std::vector<std::array<HalfSpace, 2>> sides;  // of each sum: upper, lower

  [[nodiscard]] std::size_t p() const { return claims.model.p(); }
  [[nodiscard]] const std::string& parameter(std::size_t j) const { return claims.model.parameters[j].name; }
};

std::span<const double> entries(const Eigen::VectorXd& v) { return {v.data(), static_cast<std::size_t>(v.size())}; }

std::string_view word(bounds::Side side) { return side == bounds::Side::upper ? "upper" : "lower"; }

/// The sides of a sum whose dy is less by `less`.
std::array<HalfSpace, 2> sides_of(const RiskFacet& sum, double less, const bounds::SlabRows& slabs) {
  std::array<HalfSpace, 2> sides;
  slabs.half_spaces(entries(sum.Y), entries(sum.dY), sum.y, sum.dy - less, {}, sides[0], sides[1]);
  return sides;
}

/// "effort.bias is 0.0, not 0.0001": the first member in which `claimed` differs from `expected`; else empty.
std::string difference(const Json& claimed, const Json& expected, const std::string& name = {}) {
  if (!expected.is_object()) {
    return claimed == expected ? std::string() : fmt::format("{} is {}, not {}", name, claimed.dump(), expected.dump());
  }
  for (const auto& member : expected.items()) {
    const std::string inner = name.empty() ? member.key() : name + "." + member.key();
    if (std::string found = difference(claimed.at(member.key()), member.value(), inner); !found.empty()) {
      return found;
    }
  }
  return {};
}

void judge_box(const Case& c, const Box& proved, RiskCheck& result) {
  for (std::size_t j = 0; j < c.p(); ++j) {
    const Interval &box = c.risk.box.sides[j], &least = proved.sides[j];
    if (!(box.lower <= least.lower && least.upper <= box.upper)) {
      result.failures.push_back(fmt::format("the box of {}, [{}, {}], does not contain what is proved of it, [{}, {}]",
                                            c.parameter(j), box.lower, box.upper, least.lower, least.upper));
    }
  }
}

void judge_risks(const Case& c, RiskCheck& result) {
  std::vector<double> parts;
  for (const RiskEllipsoid& e : c.risk.ellipsoids) {
    parts.push_back(e.risk);
  }
  result.spent = bounds::exact_sum(parts);
  if (!(result.spent <= c.risk.model.risk)) {
    result.failures.push_back(fmt::format("the risks of its {} ellipsoids add up to {}, more than the stated {}",
                                          parts.size(), result.spent, c.risk.model.risk));
  }
}

/// Whether samples stand as far apart as the sums take it: one in `multiplicity`, a correlation time or more.
void judge_steps(const filter::ErrorClasses& errors, LogSource& log, RiskCheck& result) {
  const Eigen::VectorXd none;
  for (const auto sensor : {filter::SampleWeight::Sensor::motion, filter::SampleWeight::Sensor::effort}) {
    const bool motion = sensor == filter::SampleWeight::Sensor::motion;
    const double correlation = (motion ? errors.motion : errors.effort).correlation;
    if (correlation == 0.0) {
      continue;
    }
    const filter::SampleWeight sample{sensor, 0, true, 0.0, none, none};
    const auto apart = static_cast<std::size_t>(sample_class(errors, sample).multiplicity);
    std::vector<double> before(apart);
    std::size_t taken = 0;
    double least = core::kInfinity;
    core::for_each_row(log, [&](const LogBlock& block, std::size_t k, bool starts) {
      taken = starts ? 0 : taken;
      double& oldest = before[taken % apart];
      least = taken < apart ? least : std::min(least, block.t[k] - oldest);
      oldest = block.t[k];
      ++taken;
    });
    if (least < correlation * (1.0 - kRounding)) {
      result.failures.push_back(
          fmt::format("{} samples of the {} take no more than {:.4g} s, and its errors are correlated over {:g} s",
                      apart, motion ? "motion" : "effort", least, correlation));
    }
  }
}

/// Takes the sums of the log. False where the claims are none that sums could be taken for.
bool take_sums(Case& c, LogSource& log, RiskCheck& result) {
  std::optional<filter::ErrorClasses> errors = commission::error_classes(c.claims.robot, c.claims.measurement);
  if (!errors && c.risk.model.warrant == core::Warrant::extrapolated) {
    errors = c.risk.model.errors;  // estimated from the log: a premise
  }
  if (!errors) {
    result.failures.emplace_back("the robot file declares no errors that average out");
    return false;
  }
  const std::string wrong = difference(error_classes_json(c.risk.model.errors), error_classes_json(*errors));
  if (!wrong.empty()) {
    result.failures.push_back(fmt::format("errors.{}, as the robot and its log have it", wrong));
  }
  judge_steps(*errors, log, result);
  commission::RiskSetOptions options{.risk = c.risk.model.risk, .delays = {}, .learning = c.risk.learning};
  for (const RiskEllipsoid& e : c.risk.ellipsoids) {
    if (std::ranges::find(options.delays, e.delay) == options.delays.end()) {
      options.delays.push_back(e.delay);
    }
  }
  std::vector<commission::RiskDirection> directions;
  for (const RiskFacet& sum : c.risk.sums) {
    directions.push_back({sum.ellipsoid, sum.weights});
  }
  try {
    c.sums = commission::risk_sums(log, c.claims.model, c.claims.measurement, c.claims.errors, *errors, c.risk.box,
                                   options, directions);
  } catch (const InvalidArgument& error) {
    result.failures.push_back(fmt::format("no sums can be taken: {}", error.what()));
    return false;
  }
  const auto name = [](const RiskEllipsoid& e) { return std::pair(e.delay, e.parameters); };
  if (!std::ranges::equal(c.risk.ellipsoids, c.sums.ellipsoids, {}, name, name)) {
    result.failures.emplace_back("its ellipsoids are not one for every delay and every block of parameters");
    return false;
  }
  return true;
}

void judge_ellipsoids(const Case& c, RiskCheck& result) {
  for (std::size_t k = 0; k < c.risk.ellipsoids.size(); ++k) {
    const RiskEllipsoid &claimed = c.risk.ellipsoids[k], &found = c.sums.ellipsoids[k];
    if (claimed.risk != found.risk) {
      result.failures.push_back(
          fmt::format("ellipsoid {} takes {} of the risk, not an equal part, {}", k, claimed.risk, found.risk));
    }
    const auto compare = [&](std::string_view what, double stated, double least) {
      if (std::isfinite(least) && !(stated >= least * (1.0 - kRounding))) {
        result.failures.push_back(
            fmt::format("the {} of ellipsoid {}, {}, is less than the log makes it, {}", what, k, stated, least));
      }
    };
    compare("log_volume", claimed.log_volume, found.log_volume);
    compare("squared_radius", claimed.squared_radius, found.squared_radius);
  }
}

void judge_sums(Case& c, RiskCheck& result) {
  const bounds::SlabRows slabs(c.risk.box);
  for (std::size_t d = 0; d < c.risk.sums.size(); ++d) {
    const RiskFacet &claimed = c.risk.sums[d], &found = c.sums.facets[d];
    const std::size_t before = result.failures.size();
    const double granted = 0.5 * found.rounding;
    const auto compare = [&](std::string_view what, double stated, double least, double less) {
      if (!(stated >= least - less)) {
        result.failures.push_back(
            fmt::format("the {} of sum {}, {}, is less than the log makes it, {}", what, d, stated, least));
      }
    };
    compare("radius", claimed.radius, found.radius, granted);
    compare("straight", claimed.share.straight, found.share.straight, granted);
    compare("worst", claimed.share.worst, found.share.worst, granted);
    c.sides.push_back(sides_of(found, granted, slabs));
    const std::array<HalfSpace, 2> stated = sides_of(claimed, 0.0, slabs);
    for (std::size_t side = 0; side < 2; ++side) {
      const std::vector<bounds::WeightedRow> alone{{c.sides.back()[side], 1.0}};
      const bounds::CertificateCheck check =
          bounds::check_bound(entries(stated[side].a), alone, c.risk.box, stated[side].b);
      if (!check.proved) {
        result.failures.push_back(fmt::format("the {} side of sum {} is sharper than the log makes it, by {:.3g}",
                                              word(stated[side].origin.side), d, check.shortfall));
      }
    }
    result.sums += result.failures.size() == before ? 1 : 0;
  }
}

std::string label(const RiskOrigin& origin, const Case& c) {
  switch (origin.kind) {
    case RiskOrigin::Kind::guaranteed: return fmt::format("row {} of feasible_set.A", origin.number);
    case RiskOrigin::Kind::sum: return fmt::format("the {} side of sum {}", word(origin.side), origin.number);
    case RiskOrigin::Kind::box: break;
  }
  return fmt::format("the box's {} side of {}", word(origin.side), c.parameter(origin.number));
}

/// The half-space that `origin` names; nothing where it is not proved.
std::optional<HalfSpace> half_space(const RiskOrigin& origin, const Case& c) {
  const bool is_upper = origin.side == bounds::Side::upper;
  if (origin.kind == RiskOrigin::Kind::sum) {
    return c.sides[origin.number][is_upper ? 0 : 1];
  }
  if (origin.kind == RiskOrigin::Kind::guaranteed) {
    const HalfSpace& facet = c.claims.facets[origin.number];
    return c.guaranteed[origin.number] ? std::optional(HalfSpace{facet.a, facet.b, {}}) : std::nullopt;
  }
  const Interval& side = c.risk.box.sides[origin.number];
  HalfSpace row{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(c.p())), is_upper ? side.upper : -side.lower, {}};
  row.a[static_cast<Eigen::Index>(origin.number)] = is_upper ? 1.0 : -1.0;
  return row;
}

void judge_facets(const Case& c, RiskCheck& result) {
  for (std::size_t k = 0; k < c.risk.model.facets.size(); ++k) {
    const HalfSpace& facet = c.risk.model.facets[k];
    const std::optional<HalfSpace> named = half_space(c.risk.origin[k], c);
    const std::vector<bounds::WeightedRow> alone{{named.value_or(HalfSpace{}), 1.0}};
    const bounds::CertificateCheck check = bounds::check_bound(entries(facet.a), alone, c.risk.box, facet.b);
    if (check.proved) {
      ++result.facets;
    } else {
      result.failures.push_back(fmt::format(
          "row {} of its set is not proved: {}", k,
          named ? fmt::format("it does not follow from {} by {:.3g}", label(c.risk.origin[k], c), check.shortfall)
                : label(c.risk.origin[k], c) + " is not"));
    }
  }
}

/// The rows of a proof. One that is not proved itself takes no part.
std::vector<bounds::WeightedRow> rows_of(const std::vector<NamedRiskRow>& proof, const Case& c) {
  const HalfSpace none{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(c.p())), 0.0, {}};
  std::vector<bounds::WeightedRow> rows;
  for (const NamedRiskRow& named : proof) {
    const std::optional<HalfSpace> row = half_space(named.origin, c);
    rows.push_back({row.value_or(none), row ? named.multiplier : 0.0});
  }
  return rows;
}

bounds::HullCheck judge_bounds(const Case& c, RiskCheck& result) {
  std::vector<bounds::BoundClaim> lower, upper;
  for (std::size_t j = 0; j < c.p(); ++j) {
    lower.push_back({c.risk.model.box.sides[j].lower, rows_of(c.risk.lower[j], c)});
    upper.push_back({c.risk.model.box.sides[j].upper, rows_of(c.risk.upper[j], c)});
  }
  bounds::HullCheck hull = bounds::check_hull(lower, upper, c.risk.box);
  if (hull.contradiction) {
    result.failures.emplace_back("what is to prove its bounds proves that no parameters explain the log");
    return hull;
  }
  for (std::size_t j = 0; j < c.p(); ++j) {
    for (const bounds::Side side : {bounds::Side::lower, bounds::Side::upper}) {
      const bool is_upper = side == bounds::Side::upper;
      const bounds::CertificateCheck& check = (is_upper ? hull.upper : hull.lower)[j];
      const std::vector<NamedRiskRow>& proof = (is_upper ? c.risk.upper : c.risk.lower)[j];
      BoundVerdict verdict{.parameter = j,
                           .side = side,
                           .stated = (is_upper ? upper : lower)[j].value,
                           .shown = is_upper ? check.bound : -check.bound,
                           .proved = check.proved,
                           .shortfall = check.shortfall,
                           .reason = {}};
      if (!check.proved) {
        const auto name = [&](std::size_t row) { return label(proof[row].origin, c); };
        verdict.reason = shortcoming(check, name, c.claims);
        result.failures.push_back(fmt::format("{} {} {} is not proved: {}", c.parameter(j),
                                              is_upper ? "<=" : ">=", verdict.stated, verdict.reason));
      }
      result.bounds.push_back(std::move(verdict));
    }
  }
  return hull;
}

/// Intervals that are published must contain what is proved; one that is the hull's was judged with it.
void judge_published(const Case& c, const bounds::HullCheck& hull, RiskCheck& result) {
  const auto judge = [&](const std::map<std::string, Interval>& published, const std::string& name,
                         const Interval& least) {
    const auto found = published.find(name);
    if (found != published.end() && !(found->second.lower <= least.lower && least.upper <= found->second.upper)) {
      result.failures.push_back(fmt::format("the interval of {}, [{}, {}], does not contain what is proved, [{}, {}]",
                                            name, found->second.lower, found->second.upper, least.lower, least.upper));
    }
  };
  const auto scales = commission::physical_scales(c.claims.robot, c.claims.model);
  for (std::size_t j = 0; j < c.p(); ++j) {
    const Interval& proved = hull.proved.sides[j];
    const auto stated = c.risk.parameters.find(c.parameter(j));
    if (stated != c.risk.parameters.end() && stated->second != c.risk.model.box.sides[j]) {
      judge(c.risk.parameters, c.parameter(j), proved);
    }
    if (scales) {
      const commission::PhysicalScale& s = (*scales)[j];
      judge(c.risk.physical, c.claims.model.parameters[j].physical,
            Interval{s.scale, s.scale} * proved - Interval{s.offset, s.offset});
    }
  }
}

}  // namespace

RiskCheck check_at_risk(const ModelClaims& claims, const RiskClaims& risk, LogSource& log, const Box& proved,
                        const std::vector<bool>& facets) {
  Case c{claims, risk, facets, {}, {}};
  RiskCheck result;
  judge_box(c, proved, result);
  judge_risks(c, result);
  if (take_sums(c, log, result)) {
    judge_ellipsoids(c, result);
    judge_sums(c, result);
    judge_facets(c, result);
    const bounds::HullCheck hull = judge_bounds(c, result);
    if (!hull.contradiction) {
      judge_published(c, hull, result);
    }
  }
  for (std::string& failure : result.failures) {
    failure = fmt::format("at a risk of {:g}: {}", risk.model.risk, failure);
  }
  return result;
}

}  // namespace wheelwright::results

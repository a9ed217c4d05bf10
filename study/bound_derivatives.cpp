// SPDX-License-Identifier: Apache-2.0
#include "study/bound_derivatives.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "bounds/linear_program.hpp"
#include "bounds/slab_rows.hpp"
#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "model/filter/sample_weights.hpp"
#include "study/bound_rates.hpp"
#include "study/study_case.hpp"

namespace wheelwright::study {

using bounds::HalfSpace;
using bounds::Side;

namespace {

constexpr double kActive = 1e-9;    // slack, relative to the block's size
constexpr double kPositive = 1e-9;  // multiplier, relative to the direction
constexpr double kOptimal = 1e-10;  // how far below the optimum counts as optimal, in sizes of the block

// ±e_j in the parameters of the block.
Eigen::VectorXd direction(const Polytope::Block& block, const HullOptimum& optimum) {
  Eigen::VectorXd c = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(block.parameters.size()));
  const auto k = std::ranges::find(block.parameters, optimum.parameter) - block.parameters.begin();
  c[k] = optimum.side == Side::upper ? 1.0 : -1.0;
  return c;
}

// Whether the row passes through θ*, as nearly as its evaluation tells.
bool is_active(const Polytope::Block& block, const HullOptimum& optimum, const HalfSpace& row) {
  const double slack = row.b - row.a.dot(optimum.at);
  const double rounding =
      64.0 * std::numeric_limits<double>::epsilon() * (std::abs(row.b) + row.a.cwiseAbs().dot(optimum.at.cwiseAbs()));
  if (slack > std::max(kActive * block.coordinates.transform.norm() * row.a.norm(), rounding)) {
    return false;  // nearly every row of a log, without a further look
  }
  const double norm = (block.coordinates.transform.transpose() * bounds::pick(row.a, block.parameters)).norm();
  return norm > 0.0 && slack <= std::max(kActive * norm, rounding);
}

void add_if_active(const Polytope::Block& block, HullOptimum& optimum, const HalfSpace& row) {
  const auto same = [&](const bounds::WeightedRow& known) { return known.row.origin == row.origin; };
  if (is_active(block, optimum, row) && std::ranges::none_of(optimum.active, same)) {
    optimum.active.push_back({row, 0.0});
  }
}

HalfSpace side_of(const Box& prior, std::size_t j, Side side) {
  const bool upper = side == Side::upper;
  HalfSpace row{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(prior.dimension())),
                upper ? prior.sides[j].upper : -prior.sides[j].lower,
                {.is_prior = true, .parameter = j, .side = side}};
  row.a[static_cast<Eigen::Index>(j)] = upper ? 1.0 : -1.0;
  return row;
}

// The vertex and its multipliers from the equations of an optimal basis.
void locate(const HullOptima& optima, HullOptimum& optimum) {
  const Polytope::Block& block = optima.set.blocks()[optimum.block];
  const Eigen::VectorXd c = block.coordinates.transform.transpose() * direction(block, optimum);
  const Eigen::VectorXd limit = Eigen::VectorXd::Constant(c.size(), 8.0);
  bounds::LinearProgram program(-limit, limit);
  program.add_rows(block.normals, block.offsets);
  bounds::LinearProgram::Basis basis;
  if (program.maximise(c / c.norm(), basis).status != bounds::LpSolution::Status::optimal ||
      std::ranges::any_of(basis.rows, [](int row) { return row < 0; })) {
    return;
  }
  Eigen::MatrixXd rows(c.size(), c.size());
  Eigen::VectorXd offsets(c.size());
  for (Eigen::Index r = 0; r < c.size(); ++r) {
    const int facet = basis.rows[static_cast<std::size_t>(r)];
    rows.row(r) = block.normals.col(facet).transpose();
    offsets[r] = block.offsets[facet];
  }
  const core::RankRevealingLu lu(rows), transposed(rows.transpose());
  if (!lu.invertible()) {
    return;
  }
  const Eigen::VectorXd lambda = transposed.solve(c);
  const std::size_t p = optima.set.dimension();
  Eigen::VectorXd theta = block.coordinates.centre + block.coordinates.transform * lu.solve(offsets);
  // Once more with the residuals of the rows themselves.
  for (Eigen::Index r = 0; r < c.size(); ++r) {
    const auto facet = static_cast<std::size_t>(basis.rows[static_cast<std::size_t>(r)]);
    const HalfSpace& row = block.facets[facet];
    const double norm = block.norms[static_cast<Eigen::Index>(facet)];
    offsets[r] = (row.b - row.a.dot(theta)) / norm;
    const double multiplier = std::max(lambda[r], 0.0);
    optimum.unique_maximiser = optimum.unique_maximiser && multiplier > kPositive * c.norm();
    optimum.active.push_back({bounds::spread(row, block.parameters, p), multiplier / norm});
  }
  theta += block.coordinates.transform * lu.solve(offsets);
  optimum.basis = optimum.active.size();
  optimum.at = Eigen::Map<const Eigen::VectorXd>(optima.set.chebyshev_centre().data(), static_cast<Eigen::Index>(p));
  for (std::size_t k = 0; k < block.parameters.size(); ++k) {
    optimum.at[static_cast<Eigen::Index>(block.parameters[k])] = theta[static_cast<Eigen::Index>(k)];
  }
  optimum.found = true;
  for (const HalfSpace& facet : block.facets) {
    add_if_active(block, optimum, bounds::spread(facet, block.parameters, p));
  }
  for (const std::size_t j : block.parameters) {
    add_if_active(block, optimum, side_of(optima.prior, j, Side::lower));
    add_if_active(block, optimum, side_of(optima.prior, j, Side::upper));
  }
}

// Derivative of max ±θ_j along s, for s growing with `sign` = 1 and falling with −1.
double directional(const HullOptima& optima, const HullOptimum& optimum, std::span<const RowRate> rates, double sign) {
  const Polytope::Block& block = optima.set.blocks()[optimum.block];
  const Eigen::MatrixXd& T = block.coordinates.transform;
  const auto q = static_cast<Eigen::Index>(block.parameters.size());
  const auto m = static_cast<Eigen::Index>(rates.size());
  Eigen::VectorXd g(m);
  Eigen::MatrixXd turned = Eigen::MatrixXd::Zero(q, m), normals(q, m);
  double largest = 0.0, sum = 0.0;
  bool couples = false;
  Eigen::VectorXd elsewhere = Eigen::VectorXd::Zero(optimum.at.size());
  const Eigen::VectorXd theta = bounds::pick(optimum.at, block.parameters);
  for (Eigen::Index i = 0; i < m; ++i) {
    const RowRate& rate = rates[static_cast<std::size_t>(i)];
    const bounds::WeightedRow& row = optimum.active[static_cast<std::size_t>(i)];
    g[i] = sign * rate.b;
    if (rate.a.size() > 0) {
      Eigen::VectorXd others = rate.a;
      for (const std::size_t j : block.parameters) {
        others[static_cast<Eigen::Index>(j)] = 0.0;
      }
      g[i] -= sign * bounds::pick(rate.a, block.parameters).dot(theta);
      couples = couples || !others.isZero(0.0);
      elsewhere -= sign * row.multiplier * others;
    }
    sum += row.multiplier * g[i];
    const Eigen::VectorXd normal = T.transpose() * bounds::pick(row.row.a, block.parameters);
    normals.col(i) = normal / normal.norm();
    g[i] /= normal.norm();
    if (rate.a.size() > 0) {
      turned.col(i) = sign / normal.norm() * (T.transpose() * bounds::pick(rate.a, block.parameters));
    }
    largest = std::max({largest, std::abs(g[i]), turned.col(i).norm()});
  }
  if (couples) {
    // The objective leaves the other blocks free: rows that come to depend on them meet the worst of all their θ.
    if (!optimum.is_regular()) {
      return core::kNan;
    }
    sum += optima.set.support({elsewhere.data(), static_cast<std::size_t>(elsewhere.size())});
  }
  if (optimum.is_regular() || largest == 0.0) {
    return sum;
  }
  // Variables: d, and where the maximiser is not unique and rows turn, the way from θ* to another optimum.
  const bool walk = !optimum.unique_maximiser && !turned.isZero(0.0);
  const Eigen::Index variables = walk ? 2 * q : q, facets = walk ? block.offsets.size() : 0;
  const Eigen::VectorXd c = T.transpose() * direction(block, optimum);
  Eigen::VectorXd objective = Eigen::VectorXd::Zero(variables);
  objective.head(q) = c / c.norm();
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(variables, m + facets + (walk ? 1 : 0));
  Eigen::VectorXd offsets(rows.cols());
  rows.topLeftCorner(q, m) = normals;
  offsets.head(m) = g / largest;
  if (walk) {
    rows.bottomLeftCorner(q, m) = turned / largest;
    for (Eigen::Index i = 0; i < facets; ++i) {
      const HalfSpace& facet = block.facets[static_cast<std::size_t>(i)];
      rows.col(m + i).tail(q) = block.normals.col(i);
      offsets[m + i] = std::max(0.0, (facet.b - facet.a.dot(theta)) / block.norms[i]);
    }
    rows.col(m + facets).tail(q) = -c / c.norm();
    offsets[m + facets] = kOptimal;
  }
  // The box is to be as small as it may: it costs digits.
  for (const double reach : {1e2, 1e4, 1e6}) {
    Eigen::VectorXd limit = Eigen::VectorXd::Constant(variables, reach);
    limit.tail(variables - q).setConstant(32.0);
    bounds::LinearProgram program(-limit, limit);
    program.add_rows(rows, offsets);
    const bounds::LpSolution solution = program.maximise(objective);
    if (solution.status == bounds::LpSolution::Status::optimal) {
      return largest * c.norm() * solution.value;
    }
  }
  return core::kNan;
}

}  // namespace

HullOptima hull_optima(const Polytope& set, const Box& prior) {
  check::that(prior.dimension() == set.dimension(), "prior box", "one side per parameter of the set");
  const std::size_t p = set.dimension();
  HullOptima optima{set, prior, std::vector<HullOptimum>(p), std::vector<HullOptimum>(p)};
  for (std::size_t b = 0; b < set.blocks().size(); ++b) {
    for (const std::size_t j : set.blocks()[b].parameters) {
      for (HullOptimum* optimum : {&optima.lower[j], &optima.upper[j]}) {
        const bool upper = optimum == &optima.upper[j];
        optimum->parameter = j;
        optimum->side = upper ? Side::upper : Side::lower;
        optimum->value = upper ? set.hull().sides[j].upper : set.hull().sides[j].lower;
        optimum->block = b;
        locate(optima, *optimum);
      }
    }
  }
  return optima;
}

void add_active_rows(HullOptima& optima, core::RegressionSource& rows, std::vector<std::size_t> excluded) {
  check::that(rows.parameters() == optima.set.dimension(), "rows", "as many parameters as the set");
  std::ranges::sort(excluded);
  const bounds::SlabRows slabs(optima.prior);
  HalfSpace upper, lower;
  core::for_each_block(rows, [&](const RegressionBlock& block) {
    for (Eigen::Index r = 0; r < block.rows(); ++r) {
      if (std::ranges::binary_search(excluded, block.sample[static_cast<std::size_t>(r) / block.outputs])) {
        continue;
      }
      slabs.half_spaces(block, r, upper, lower);
      for (auto* side : {&optima.lower, &optima.upper}) {
        for (HullOptimum& optimum : *side) {
          if (optimum.found) {
            add_if_active(optima.set.blocks()[optimum.block], optimum, upper);
            add_if_active(optima.set.blocks()[optimum.block], optimum, lower);
          }
        }
      }
    }
  });
}

OneSided bound_derivative(const HullOptima& optima, const HullOptimum& optimum, std::span<const RowRate> left,
                          std::span<const RowRate> right) {
  check::that(left.size() == optimum.active.size() && right.size() == optimum.active.size(), "rates",
              "one for each active row");
  if (!optimum.found) {
    return {core::kNan, core::kNan};
  }
  const double sign = optimum.side == Side::upper ? 1.0 : -1.0;
  return {-sign * directional(optima, optimum, left, -1.0), sign * directional(optima, optimum, right, 1.0)};
}

std::string row_in_words(const bounds::RowOrigin& origin) {
  const char* side = origin.side == Side::upper ? "upper" : "lower";
  return origin.is_prior ? fmt::format("the prior's {} side of parameter {}", side, origin.parameter)
                         : fmt::format("row {} (t = {:.6g} s)", origin.sample, origin.t);
}

std::string why_not_regular(const HullOptimum& optimum, const std::string& name) {
  const std::string bound = fmt::format("the {} bound of {}", optimum.side == Side::upper ? "upper" : "lower", name);
  if (!optimum.found) {
    return bound + ": no vertex is known, the set is flat to rounding";
  }
  std::string words;
  if (!optimum.unique_maximiser) {
    words = bound + " is attained on more than one point of the set, or held by rows of which one does not count";
  }
  if (optimum.active.size() > optimum.basis) {
    words += words.empty() ? bound + ": " : "; ";
    words += fmt::format("{} constraints meet where {} define the vertex", optimum.active.size(), optimum.basis);
    for (std::size_t i = optimum.basis; i < std::min(optimum.active.size(), optimum.basis + 3); ++i) {
      words += (i == optimum.basis ? ": beside these " : ", ") + row_in_words(optimum.active[i].row.origin);
    }
    words += optimum.active.size() > optimum.basis + 3 ? ", …" : "";
  }
  return words;
}

namespace {

struct Sensor {
  const char* name;
  const char* unit;
  model::NoiseBound model::SensorNoise::*bound;
};

constexpr Sensor kSensors[] = {{"wheel_speed", "rad/s", &model::SensorNoise::wheel_speed},
                               {"wheel_angle", "rad", &model::SensorNoise::wheel_angle},
                               {"effort", "", &model::SensorNoise::effort},
                               {"position", "m", &model::SensorNoise::position},
                               {"heading", "rad", &model::SensorNoise::heading}};

// The sensor behind "declared." or "noise.".
const Sensor* sensor_of(std::string_view name) {
  for (const std::string_view family : {"declared.", "noise."}) {
    for (const Sensor& sensor : kSensors) {
      if (name.starts_with(family) && name.substr(family.size()) == sensor.name) {
        return &sensor;
      }
    }
  }
  return nullptr;
}

const char* effort_unit(model::EffortKind kind) {
  return kind == model::EffortKind::torque ? "N·m" : kind == model::EffortKind::current ? "A" : "V";
}

LocalInput prior_input(const RobotAt& at, const Model& model, const std::string& name) {
  constexpr std::string_view kFamily = "prior.", kLower = ".lower", kUpper = ".upper";
  const bool lower = name.ends_with(kLower), upper = name.ends_with(kUpper);
  const std::string physical =
      name.substr(kFamily.size(), name.size() - kFamily.size() - (lower || upper ? kLower.size() : 0));
  const auto found = std::ranges::find(model.parameters, physical, &model::Parameter::physical);
  check::that(found != model.parameters.end(), "input " + name, "prior.NAME of a parameter of the model");
  const model::PriorBox box = model::prior_box(at.robot, model);
  const auto j = static_cast<std::size_t>(found - model.parameters.begin());
  const Interval side{box.bounds[j].lower / found->per_physical, box.bounds[j].upper / found->per_physical};
  if (lower) {
    return {name, found->physical_unit, side.lower, PriorRate{physical, 1.0, 1.0, 0.0, 0.0}};
  }
  if (upper) {
    return {name, found->physical_unit, side.upper, PriorRate{physical, 0.0, 0.0, 1.0, 1.0}};
  }
  // A factor of the width: about the geometric mean where both sides are above 0, else about the middle, and a side
  // that is not below 0 stays so.
  if (side.lower > 0.0) {
    const double reach = 0.5 * std::log(side.upper / side.lower);
    return {name, "1", 1.0,
            PriorRate{physical, -reach * side.lower, -reach * side.lower, reach * side.upper, reach * side.upper}};
  }
  const double half = 0.5 * side.width();
  return {name, "1", 1.0, PriorRate{physical, -half, side.lower == 0.0 ? 0.0 : -half, half, half}};
}

}  // namespace

LocalInput local_input(const RobotAt& at, const Model& model, const std::string& name) {
  const Robot& robot = at.robot;
  if (name.starts_with("prior.")) {
    return prior_input(at, model, name);
  }
  if (const Sensor* sensor = sensor_of(name)) {
    const model::NoiseBound& bound = robot.noise.*(sensor->bound);
    check::that(bound.value.has_value(), "input " + name, "a bound in the robot file");
    return {name, sensor->bound == &model::SensorNoise::effort ? effort_unit(robot.effort) : sensor->unit,
            *bound.value};
  }
  if (name == "filter.alpha" || name == "filter.beta") {
    return {name, "1/s", name == "filter.alpha" ? at.filter.alpha : at.filter.beta};
  }
  if (double Robot::*const geometry = length_of(name)) {
    const double length = robot.*geometry;
    check::that(length > 0.0, "input " + name, "a robot with wheels");
    return {name, "m", length};
  }
  check::that(name == "encoder_counts_per_turn", "input " + name,
              "declared.SENSOR, filter.alpha, filter.beta, wheel_radius, track_width, encoder_counts_per_turn, "
              "prior.NAME, prior.NAME.lower or prior.NAME.upper");
  check::that(robot.encoder_counts_per_turn.has_value(), "input " + name, "a value in the robot file");
  return {name, "1", *robot.encoder_counts_per_turn};
}

RobotAt with_input(RobotAt at, const LocalInput& input, double x) {
  if (const Sensor* sensor = sensor_of(input.name)) {
    (at.robot.noise.*(sensor->bound)).value = x;
  } else if (input.name == "filter.alpha") {
    at.filter.alpha = x;
  } else if (input.name == "filter.beta") {
    if (!at.robot.filter.alpha) {
      at.filter.alpha *= x / at.filter.beta;
    }
    at.filter.beta = x;
  } else if (double Robot::*const geometry = length_of(input.name)) {
    at.robot.*geometry = x;
  } else {
    at.robot.encoder_counts_per_turn = x;
  }
  return at;
}

std::vector<std::string> robot_inputs(const RobotAt& at) {
  std::vector<std::string> names;
  for (const Sensor& sensor : kSensors) {
    if ((at.robot.noise.*sensor.bound).value) {
      names.push_back(std::string("declared.") + sensor.name);
    }
  }
  if (at.robot.encoder_counts_per_turn) {
    names.emplace_back("encoder_counts_per_turn");
  }
  names.insert(names.end(), {"filter.alpha", "filter.beta"});
  if (model::on_two_wheels(at.robot)) {
    names.insert(names.end(), {"wheel_radius", "track_width"});
  }
  return names;
}

namespace {

ParameterDerivative join(const BoundRate& lower, const BoundRate& upper, const LocalInput& input, double width) {
  ParameterDerivative d;
  d.lower = lower.value;
  d.upper = upper.value;
  d.width = {upper.value.left - lower.value.left, upper.value.right - lower.value.right};
  d.differentiable = lower.why_not.empty() && upper.why_not.empty();
  d.why_not = lower.why_not + (lower.why_not.empty() || upper.why_not.empty() ? "" : "; ") + upper.why_not;
  if (d.differentiable && width > 0.0 && input.value != 0.0) {
    d.elasticity = input.value / width * 0.5 * (d.width.left + d.width.right);
  }
  return d;
}

std::vector<std::string> default_inputs(const RobotAt& at, const Model& model, const HullOptima& optima) {
  std::vector<std::string> names = robot_inputs(at);
  std::erase_if(names, [&](const std::string& name) { return local_input(at, model, name).value == 0.0; });
  const std::vector<bool> declared = model::prior_box(at.robot, model).declared;
  for (std::size_t j = 0; j < model.p(); ++j) {
    for (const bounds::Side side : {bounds::Side::lower, bounds::Side::upper}) {
      bool holds = declared[j];
      for (const auto* bounds : {&optima.lower, &optima.upper}) {
        for (const HullOptimum& optimum : *bounds) {
          for (const bounds::WeightedRow& active : optimum.active) {
            const bounds::RowOrigin& origin = active.row.origin;
            holds = holds || (origin.is_prior && origin.parameter == j && origin.side == side);
          }
        }
      }
      if (holds) {
        names.push_back("prior." + model.parameters[j].physical + (side == bounds::Side::lower ? ".lower" : ".upper"));
      }
    }
  }
  return names;
}

}  // namespace

LocalSensitivity local_derivatives(LogSource& log, const Commissioning& c, const LocalOptions& options) {
  check::that(options.step > 0.0 && options.step <= 0.01, "step", "a relative step in (0, 0.01]");
  LocalSensitivity result;
  result.warrant = c.model.warrant;
  const Model& model = c.model.model;
  for (const commission::ParameterResult& p : c.parameters) {
    result.parameters.push_back(p.parameter.name);
    result.units.push_back(p.parameter.unit);
    result.lower.push_back(p.lower);
    result.upper.push_back(p.upper);
  }
  if (c.feasible.status == FeasibleSet::Status::empty || !c.feasible.polytope) {
    result.notes.emplace_back("the feasible set is empty: there are no bounds whose derivatives could be taken");
    return result;
  }
  const auto is_union = [](const FeasibleSet& set) { return set.sign_parts > 1 || set.convexified; };
  if (is_union(c.feasible) || std::ranges::any_of(c.earlier, is_union, &commission::EarlierSet::set)) {
    result.notes.emplace_back(
        "signs of parameters with noisy columns are open: the set is a union of parts, and derivatives of its bounds "
        "are not offered");
    return result;
  }
  const RobotAt at{c.model.robot, c.model.filter};
  const std::vector<BoundPass> passes = bound_passes(log, c, options.confidence);
  const HullOptima& optima = passes.back().optima;
  result.notes.emplace_back(
      "instants, columns, parameters, outliers left out and the number of passes are held as commissioning chose them");
  if (!noise_is_declared(c)) {
    result.notes.emplace_back(
        "noise is estimated from the log: the rows' error bounds are held fixed, how the estimate itself follows an "
        "input is not seen");
  }

  const std::vector<std::string> names = options.inputs.empty() ? default_inputs(at, model, optima) : options.inputs;
  for (const std::string& name : names) {
    const LocalInput input = local_input(at, model, name);
    LocalDerivative derivative{input.name, input.unit, input.value, {}};
    const BoundRates rates = bound_rates(log, c, passes, input, options.step, options.confidence);
    for (std::size_t j = 0; j < model.p(); ++j) {
      derivative.parameters.push_back(join(rates.lower[j], rates.upper[j], input, result.upper[j] - result.lower[j]));
    }
    result.inputs.push_back(std::move(derivative));
  }
  result.optima = optima;
  log.rewind();
  return result;
}

std::vector<std::string> not_differentiable(const LocalSensitivity& result) {
  std::vector<std::string> sentences;
  for (const LocalDerivative& input : result.inputs) {
    for (std::size_t j = 0; j < input.parameters.size(); ++j) {
      if (!input.parameters[j].differentiable) {
        sentences.push_back(fmt::format("bounds of {} are not differentiable in {}: {}", result.parameters[j],
                                        input.input, input.parameters[j].why_not));
      }
    }
  }
  return sentences;
}

}  // namespace wheelwright::study

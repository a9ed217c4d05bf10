// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/local_derivatives.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/study/bound_rates.hpp>
#include <wheelwright/study/local_inputs.hpp>
#include <wheelwright/study/row_rates.hpp>

namespace wheelwright {
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
  const std::vector<bool> declared = prior_box(at.robot, model).declared;
  for (std::size_t j = 0; j < model.p(); ++j) {
    for (const Side side : {Side::lower, Side::upper}) {
      bool holds = declared[j];
      for (const auto* bounds : {&optima.lower, &optima.upper}) {
        for (const HullOptimum& optimum : *bounds) {
          for (const WeightedRow& active : optimum.active) {
            const RowOrigin& origin = active.row.origin;
            holds = holds || (origin.is_prior && origin.parameter == j && origin.side == side);
          }
        }
      }
      if (holds) {
        names.push_back("prior." + model.parameters[j].physical + (side == Side::lower ? ".lower" : ".upper"));
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
  for (const ParameterResult& p : c.parameters) {
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
  if (is_union(c.feasible) || std::ranges::any_of(c.earlier, is_union, &EarlierSet::set)) {
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

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/sensitivity/local_derivatives.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/limits.hpp>
#include <wheelwright/sensitivity/local_inputs.hpp>
#include <wheelwright/sensitivity/row_rates.hpp>

namespace wheelwright {
namespace {

constexpr double kAgree = 1e-6;  // left and right derivative, relative

// A lower side at 0 that holds a bound: below it, errors of the rows' columns count with the other sign.
bool sign_opens(const HullOptimum& optimum, const Box& box, std::size_t j) {
  return box.sides[j].lower == 0.0 && std::ranges::any_of(optimum.active, [&](const WeightedRow& active) {
           const RowOrigin& origin = active.row.origin;
           return origin.is_prior && origin.parameter == j && origin.side == Side::lower;
         });
}

bool agree(const OneSided& d, double noise) {
  return std::abs(d.left - d.right) <= kAgree * std::max(std::abs(d.left), std::abs(d.right)) + noise;
}

struct Derived {
  OneSided value;
  std::string why_not;
};

Derived derive(const HullOptima& optima, const HullOptimum& optimum, const RowRates& rates, double noise,
               const std::string& name) {
  if (!optimum.found) {
    return {{kNan, kNan}, why_not_regular(optimum, name)};
  }
  if (!rates.trouble.empty()) {
    return {{kNan, kNan}, rates.trouble};
  }
  Derived result{bound_derivative(optima, optimum, rates.left, rates.right), {}};
  if (!agree(result.value, noise)) {
    result.why_not = why_not_regular(optimum, name);
    if (result.why_not.empty()) {
      result.why_not = "a row that holds the bound has a kink, or comes to couple parameters that the log keeps apart";
    }
  }
  return result;
}

ParameterDerivative join(const Derived& lower, const Derived& upper, const LocalInput& input, double width) {
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
  if (c.feasible.sign_parts > 1 || c.feasible.convexified) {
    result.notes.emplace_back(
        "signs of parameters with noisy columns are open: the set is a union of parts, and derivatives of its bounds "
        "are not offered");
    return result;
  }
  const RobotAt at{c.model.robot, c.model.filter};
  HullOptima optima = hull_optima(*c.feasible.polytope, c.prior);
  {
    RegressionStream rows = rows_of(log, c, at, options.confidence);
    add_active_rows(optima, rows, c.dropped);
  }
  const LogRows wanted = active_rows(optima);
  result.notes.emplace_back("instants, columns, parameters and outliers left out are held as commissioning chose them");
  if (!noise_is_declared(c)) {
    result.notes.emplace_back(
        "noise is estimated from the log: the rows' error bounds are held fixed, how the estimate itself follows an "
        "input is not seen");
  }

  const std::vector<std::string> names = options.inputs.empty() ? default_inputs(at, model, optima) : options.inputs;
  for (const std::string& name : names) {
    const LocalInput input = local_input(at, model, name);
    LocalDerivative derivative{input.name, input.unit, input.value, {}};
    const double step = options.step * std::abs(input.value);
    LogRows before, after;
    Box prior_before, prior_after;
    if (!input.prior) {
      check::that(step > 0.0, "input " + name, "a value other than 0");
      const RobotAt low = with_input(at, input, input.value - step), high = with_input(at, input, input.value + step);
      before = rows_at(log, c, low, options.confidence, wanted);
      after = rows_at(log, c, high, options.confidence, wanted);
      prior_before = prior_of(low.robot);
      prior_after = prior_of(high.robot);
    }
    for (std::size_t j = 0; j < model.p(); ++j) {
      const double width = result.upper[j] - result.lower[j];
      const double noise = 1e-9 * width / (input.value != 0.0 ? std::abs(input.value) : 1.0);
      const auto derived = [&](const HullOptimum& optimum) {
        if (!input.prior) {
          return derive(optima, optimum,
                        row_rates(optima, optimum, input, step, before, prior_before, after, prior_after), noise,
                        result.parameters[j]);
        }
        const auto of = std::ranges::find(model.parameters, input.prior->parameter, &Parameter::physical);
        const auto k = static_cast<std::size_t>(of - model.parameters.begin());
        Derived d = derive(optima, optimum, prior_rates(optimum, *input.prior, of->per_physical, k), noise,
                           result.parameters[j]);
        if (name.ends_with(".lower") && sign_opens(optimum, c.prior, k)) {
          d.value.left = kNan;
          d.why_not =
              fmt::format("the prior's lower side of {} is 0 and is met: below it, a sign is open", of->physical);
        }
        return d;
      };
      derivative.parameters.push_back(join(derived(optima.lower[j]), derived(optima.upper[j]), input, width));
    }
    result.inputs.push_back(std::move(derivative));
  }
  result.optima = std::move(optima);
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

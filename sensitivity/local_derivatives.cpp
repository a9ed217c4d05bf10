// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/sensitivity/local_derivatives.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/bounds/slab_rows.hpp>
#include <wheelwright/commission/noise_budget.hpp>
#include <wheelwright/core/check.hpp>
#include <wheelwright/filter/regression_stream.hpp>
#include <wheelwright/sensitivity/local_inputs.hpp>

namespace wheelwright {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kAgree = 1e-6;                   // left and right derivative, relative
constexpr double kSmooth = 1e-3;                  // forward and backward rates of a row, relative
constexpr double kNoise = 1e-6;                   // of a rate, in sizes of the set per relative change of the input
constexpr double kJump = 1e3;                     // beyond this, in the same unit, a row jumps
using Row = std::pair<std::size_t, std::size_t>;  // sample, output
struct BothSides {
  HalfSpace upper, lower;
};
using RowsAt = std::map<Row, BothSides>;

bool is_declared(const Commissioning& c) {
  return std::ranges::all_of(c.noise, [](const OutputNoise& o) { return o.origin == NoiseOrigin::declared; });
}

Box prior_of(const Robot& robot, const Model& model) { return Box{prior_box(robot, model).bounds}; }

// The log's rows for the robot `at`, chosen things as in `c`.
RegressionStream rows_of(LogSource& log, const Commissioning& c, const RobotAt& at, const Model& model,
                         double confidence) {
  const Measurement& measurement = c.model.measurement;
  SignalErrors errors = c.row_errors;
  if (is_declared(c)) {
    errors = propagate(model, at.filter, measurement, noise_budget(at.robot, measurement, c.survey).sensors,
                       {.mode = c.noise_mode,
                        .confidence = confidence,
                        .rows = static_cast<double>(c.survey.rows),
                        .largest_step = c.survey.largest_step});
  }
  FilterDesign filter = at.filter;
  // The same instants, whatever β: an instant that stands on the edge stays.
  filter.settle *= filter.beta / c.model.filter.beta * (1.0 - 1e-9);
  return RegressionStream(log, RegressorFilter(model, filter, measurement, errors));
}

// The half-spaces of `wanted` rows.
RowsAt rows_at(LogSource& log, const Commissioning& c, const RobotAt& at, double confidence, const RowsAt& wanted) {
  const Model model = make_model(at.robot);
  const SlabRows slabs(prior_of(at.robot, model));
  RegressionStream rows = rows_of(log, c, at, model, confidence);
  RowsAt found;
  RegressionBlock block;
  rows.rewind();
  while (found.size() < wanted.size() && rows.next(block)) {
    for (Eigen::Index r = 0; r < block.rows(); ++r) {
      const auto k = static_cast<std::size_t>(r);
      const Row row{block.sample[k / block.outputs], k % block.outputs};
      if (wanted.contains(row)) {
        BothSides& both = found[row];
        slabs.half_spaces(block, r, both.upper, both.lower);
      }
    }
  }
  return found;
}

RowsAt active_rows(const HullOptima& optima) {
  RowsAt rows;
  for (const auto* side : {&optima.lower, &optima.upper}) {
    for (const HullOptimum& optimum : *side) {
      for (const WeightedRow& active : optimum.active) {
        const RowOrigin& origin = active.row.origin;
        if (!origin.is_prior) {
          rows[{origin.sample, origin.output}];
        }
      }
    }
  }
  return rows;
}

// The active half-space `row` where the input has been moved; nothing where it is gone.
std::optional<HalfSpace> moved(const HalfSpace& row, const RowsAt& rows, const Box& prior) {
  HalfSpace result = row;
  if (row.origin.is_prior) {
    const Interval& side = prior.sides[row.origin.parameter];
    result.b = row.origin.side == Side::upper ? side.upper : -side.lower;
    return result;
  }
  const auto at = rows.find({row.origin.sample, row.origin.output});
  if (at == rows.end()) {
    return std::nullopt;
  }
  return row.origin.side == Side::upper ? at->second.upper : at->second.lower;
}

RowRate rate(const HalfSpace& from, const HalfSpace& to, double step) {
  return {(to.a - from.a) / step, (to.b - from.b) / step};
}

struct Rates {
  std::vector<RowRate> left, right;
  std::string trouble;  // why there are none
};

// Rates of the active rows, by differences; one-sided where a row has a kink.
Rates row_rates(const HullOptima& optima, const HullOptimum& optimum, const LocalInput& input, double step,
                const RowsAt& before, const Box& prior_before, const RowsAt& after, const Box& prior_after) {
  Rates rates;
  const Polytope::Block& block = optima.set.blocks()[optimum.block];
  for (const WeightedRow& active : optimum.active) {
    const auto low = moved(active.row, before, prior_before), high = moved(active.row, after, prior_after);
    if (!low || !high) {
      rates.trouble = row_in_words(active.row.origin) + " is there on one side of the value only";
      return rates;
    }
    const RowRate left = rate(*low, active.row, step), right = rate(active.row, *high, step);
    const double g_left = left.b - left.a.dot(optimum.at), g_right = right.b - right.a.dot(optimum.at);
    double size = 0.0;  // of the block along the row
    for (std::size_t k = 0; k < block.parameters.size(); ++k) {
      const double a = active.row.a[static_cast<Eigen::Index>(block.parameters[k])];
      size = std::hypot(size, a * block.coordinates.transform.row(static_cast<Eigen::Index>(k)).norm());
    }
    const double scale = size / std::abs(input.value);
    if (std::abs(g_left - g_right) <= kSmooth * (std::abs(g_left) + std::abs(g_right)) + kNoise * scale) {
      rates.left.push_back(rate(*low, *high, 2.0 * step));
      rates.right.push_back(rates.left.back());
    } else if (std::abs(g_left - g_right) > kJump * scale) {
      rates.trouble = row_in_words(active.row.origin) + " jumps";
      return rates;
    } else {
      rates.left.push_back(left);
      rates.right.push_back(right);
    }
  }
  return rates;
}

// Rates where only sides of the prior move.
Rates prior_rates(const HullOptimum& optimum, const PriorRate& prior, double per_physical, std::size_t parameter) {
  Rates rates;
  for (const WeightedRow& active : optimum.active) {
    const RowOrigin& origin = active.row.origin;
    RowRate left, right;
    if (origin.is_prior && origin.parameter == parameter) {
      const bool upper = origin.side == Side::upper;
      left.b = per_physical * (upper ? prior.upper_left : -prior.lower_left);
      right.b = per_physical * (upper ? prior.upper_right : -prior.lower_right);
    }
    rates.left.push_back(std::move(left));
    rates.right.push_back(std::move(right));
  }
  return rates;
}

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

Derived derive(const HullOptima& optima, const HullOptimum& optimum, const Rates& rates, double noise,
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
    RegressionStream rows = rows_of(log, c, at, model, options.confidence);
    add_active_rows(optima, rows, c.dropped);
  }
  const RowsAt wanted = active_rows(optima);
  result.notes.emplace_back("instants, columns, parameters and outliers left out are held as commissioning chose them");
  if (!is_declared(c)) {
    result.notes.emplace_back(
        "noise is estimated from the log: the rows' error bounds are held fixed, how the estimate itself follows an "
        "input is not seen");
  }

  const std::vector<std::string> names = options.inputs.empty() ? default_inputs(at, model, optima) : options.inputs;
  for (const std::string& name : names) {
    const LocalInput input = local_input(at, model, name);
    LocalDerivative derivative{input.name, input.unit, input.value, {}};
    const double step = options.step * std::abs(input.value);
    RowsAt before, after;
    Box prior_before, prior_after;
    if (!input.prior) {
      check::that(step > 0.0, "input " + name, "a value other than 0");
      const RobotAt low = with_input(at, input, input.value - step), high = with_input(at, input, input.value + step);
      before = rows_at(log, c, low, options.confidence, wanted);
      after = rows_at(log, c, high, options.confidence, wanted);
      prior_before = prior_of(low.robot, make_model(low.robot));
      prior_after = prior_of(high.robot, make_model(high.robot));
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

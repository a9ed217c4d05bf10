// SPDX-License-Identifier: Apache-2.0
#include "study/bound_rates.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include <fmt/format.h>

#include "bounds/slab_rows.hpp"
#include "commission/noise_budget.hpp"
#include "commission/thrust_bound.hpp"
#include "core/check.hpp"
#include "core/limits.hpp"
#include "detector/threshold.hpp"
#include "model/filter/motion_bound.hpp"

namespace wheelwright::study {
namespace {

constexpr double kSmooth = 1e-3;  // forward and backward rates of a row, relative
constexpr double kBent = 0.1;     // their difference, in rates of the row's parts per relative change of the input
constexpr double kNoise = 1e-6;   // of a rate, in sizes of the set per relative change of the input
constexpr double kJump = 1e3;     // beyond this, in the same unit, a row jumps

// The active half-space `row` where the input has been moved; nothing where it is gone.
std::optional<bounds::HalfSpace> moved(const bounds::HalfSpace& row, const RowsBeside& beside) {
  bounds::HalfSpace result = row;
  if (row.origin.is_prior) {
    const Interval& side = beside.prior.sides[row.origin.parameter];
    result.b = row.origin.side == bounds::Side::upper ? side.upper : -side.lower;
    return result;
  }
  const auto at = beside.rows.find({row.origin.sample, row.origin.output});
  if (at == beside.rows.end()) {
    return std::nullopt;
  }
  return row.origin.side == bounds::Side::upper ? at->second.upper : at->second.lower;
}

RowRate rate(const bounds::HalfSpace& from, const bounds::HalfSpace& to, double step) {
  return {(to.a - from.a) / step, (to.b - from.b) / step};
}

filter::SignalErrors declared_errors(const Commissioning& c, const RobotAt& at, double confidence) {
  return filter::propagate(model::make_model(at.robot), at.filter, c.model.measurement,
                           commission::noise_budget(at.robot, c.model.measurement).sensors,
                           {.mode = c.noise_mode,
                            .confidence = confidence,
                            .rows = static_cast<double>(c.survey.rows),
                            .largest_step = c.survey.largest_step});
}

}  // namespace

bool noise_is_declared(const Commissioning& c) {
  return std::ranges::all_of(c.noise,
                             [](const commission::OutputNoise& o) { return o.origin == core::NoiseOrigin::declared; });
}

Box prior_of(const Robot& robot) { return Box{model::prior_box(robot, model::make_model(robot)).bounds}; }

filter::MotionBound motion_at(LogSource& log, const Commissioning& c, const RobotAt& at,
                              std::span<const Interval> sides, double confidence) {
  const Model model = model::make_model(at.robot);
  const Measurement& measurement = c.model.measurement;
  filter::MotionBound bound = sides.empty() ? filter::MotionBound{} : filter::motion_bound(model, sides);
  bound.limit = commission::coordinate_limit(
      model, commission::acceleration_limit(at.robot, c.survey, measurement.motion,
                                            commission::noise_budget(at.robot, measurement).sensors.motion));
  if (noise_is_declared(c) && c.dropped.empty()) {
    filter::SignalErrors errors = declared_errors(c, at, confidence);
    errors.motion.limit = bound.limit;
    commission::sharpen(bound, commission::thrust_bound(log, model, measurement, errors),
                        sides.empty() ? prior_of(at.robot) : Box{{sides.begin(), sides.end()}});
  }
  return bound;
}

TorqueRows rows_of(LogSource& log, const Commissioning& c, const RobotAt& at, const filter::MotionBound& motion,
                   double confidence) {
  const Model model = model::make_model(at.robot);
  const Measurement& measurement = c.model.measurement;
  filter::SignalErrors errors = c.row_errors;
  if (noise_is_declared(c)) {
    errors = declared_errors(c, at, confidence);
    const Eigen::VectorXd effort = errors.motion.effort;
    errors.motion = motion;
    errors.motion.effort = effort;
  }
  FilterDesign filter = at.filter;
  // The same instants, whatever β: an instant that stands on the edge stays.
  filter.settle *= filter.beta / c.model.filter.beta * (1.0 - 1e-9);
  return TorqueRows(log, RegressorFilter(model, filter, measurement, errors));
}

LogRows pick_rows(core::RegressionSource& rows, const Box& prior, const LogRows& wanted) {
  const bounds::SlabRows slabs(prior);
  LogRows found;
  RegressionBlock block;
  rows.rewind();
  while (found.size() < wanted.size() && rows.next(block)) {
    for (Eigen::Index r = 0; r < block.rows(); ++r) {
      const auto k = static_cast<std::size_t>(r);
      const std::pair<std::size_t, std::size_t> row{block.sample[k / block.outputs], k % block.outputs};
      if (wanted.contains(row)) {
        RowSides& both = found[row];
        slabs.half_spaces(block, r, both.upper, both.lower);
      }
    }
  }
  return found;
}

LogRows active_rows(const HullOptima& optima) {
  LogRows rows;
  for (const auto* bounds : {&optima.lower, &optima.upper}) {
    for (const HullOptimum& optimum : *bounds) {
      for (const bounds::WeightedRow& active : optimum.active) {
        const bounds::RowOrigin& origin = active.row.origin;
        if (!origin.is_prior) {
          RowSides& both = rows[{origin.sample, origin.output}];
          (origin.side == bounds::Side::upper ? both.upper : both.lower) = active.row;
        }
      }
    }
  }
  return rows;
}

RowRates row_rates(const HullOptima& optima, const HullOptimum& optimum, double reach, double step,
                   const RowsBeside& below, const RowsBeside& above, bool curved) {
  RowRates rates;
  const Polytope::Block& block = optima.set.blocks()[optimum.block];
  for (const bounds::WeightedRow& active : optimum.active) {
    const auto low = moved(active.row, below), high = moved(active.row, above);
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
    const double scale = size / reach;
    const double parts = std::abs(left.b) + left.a.cwiseAbs().dot(optimum.at.cwiseAbs());
    const double curvature = kBent * step / reach * parts;
    const double overlooked = curved ? kSmooth * (std::abs(g_left) + std::abs(g_right)) : 0.0;
    if (std::abs(g_left - g_right) <= curvature + overlooked + kNoise * scale) {
      rates.left.push_back(rate(*low, *high, 2.0 * step));
      rates.right.push_back(rates.left.back());
    } else if (!active.row.origin.is_prior && std::abs(g_left - g_right) > kJump * scale) {
      rates.trouble = row_in_words(active.row.origin) + " jumps";
      return rates;
    } else {
      rates.left.push_back(left);
      rates.right.push_back(right);
    }
  }
  return rates;
}

namespace {

constexpr double kAgree = 1e-6;  // left and right derivative, relative
constexpr const char* kBefore = "a set before, which bounds the motion between samples: ";

// What is wrong with the set of a pass before, said once however many passes ago that was.
std::string of_set_before(const std::string& why) { return why.starts_with(kBefore) ? why : kBefore + why; }

// An input a step below and above its value.
struct Beside {
  double reach = 0.0, step = 0.0;
  RobotAt below, above;
  Box prior_below, prior_above;
};

Beside beside(const Commissioning& c, const LocalInput& input, double relative_step) {
  const RobotAt at{c.model.robot, c.model.filter};
  Beside b{std::abs(input.value), 0.0, at, at, c.prior, c.prior};
  if (!input.prior) {
    b.step = relative_step * b.reach;
    check::that(b.step > 0.0, "input " + input.name, "a value other than 0");
    b.below = with_input(at, input, input.value - b.step);
    b.above = with_input(at, input, input.value + b.step);
    b.prior_below = prior_of(b.below.robot);
    b.prior_above = prior_of(b.above.robot);
    return b;
  }
  const PriorRate& rate = *input.prior;
  const auto& parameters = c.model.model.parameters;
  const auto of = std::ranges::find(parameters, rate.parameter, &model::Parameter::physical);
  const auto j = static_cast<std::size_t>(of - parameters.begin());
  if (b.reach == 0.0) {
    b.reach = c.prior.sides[j].width() / of->per_physical;
  }
  b.step = relative_step * b.reach;
  const double per_step = of->per_physical * b.step;
  b.prior_below.sides[j].lower -= per_step * rate.lower_left;
  b.prior_below.sides[j].upper -= per_step * rate.upper_left;
  b.prior_above.sides[j].lower += per_step * rate.lower_right;
  b.prior_above.sides[j].upper += per_step * rate.upper_right;
  return b;
}

// The hull of the set before beside the input's value.
struct MovedSides {
  std::vector<Interval> below, above;
  std::string trouble{};  // why it is not known
  std::string kink{};     // why a side that matters has no derivative, but one to each side
};

bool differ(const filter::MotionBound& a, const filter::MotionBound& b) {
  return a.mobility.size() != b.mobility.size() ||
         (a.mobility.size() > 0 && (a.mobility != b.mobility || a.largest != b.largest));
}

MovedSides moved_sides(const Model& model, const std::vector<Interval>& sides, const BoundRates& rates, double step) {
  MovedSides moved{sides, sides};
  const filter::MotionBound bound = filter::motion_bound(model, sides);
  for (std::size_t j = 0; j < sides.size(); ++j) {
    const auto move = [&](double Interval::*side, double outward, const BoundRate& rate) {
      std::vector<Interval> wider = sides;
      wider[j].*side += outward * (1e-3 * core::magnitude(sides[j]) + core::kTiny);
      if (!differ(bound, filter::motion_bound(model, wider))) {
        return;
      }
      if (std::isnan(rate.value.left) || std::isnan(rate.value.right)) {
        moved.trouble = rate.why_not;
        return;
      }
      if (moved.kink.empty()) {
        moved.kink = rate.why_not;
      }
      moved.below[j].*side -= step * rate.value.left;
      moved.above[j].*side += step * rate.value.right;
    };
    move(&Interval::lower, -1.0, rates.lower[j]);
    move(&Interval::upper, 1.0, rates.upper[j]);
  }
  return moved;
}

// The parameter whose prior's lower side is 0, holds a bound, and goes down: below 0 errors of the rows' column count
// with the other sign. p where there is none.
std::size_t opened_sign(const HullOptimum& optimum, const Box& at, const Box& moved) {
  for (const bounds::WeightedRow& active : optimum.active) {
    const bounds::RowOrigin& origin = active.row.origin;
    if (origin.is_prior && origin.side == bounds::Side::lower && at.sides[origin.parameter].lower == 0.0 &&
        moved.sides[origin.parameter].lower < 0.0) {
      return origin.parameter;
    }
  }
  return at.dimension();
}

bool agree(const OneSided& d, double noise) {
  return std::abs(d.left - d.right) <= kAgree * std::max(std::abs(d.left), std::abs(d.right)) + noise;
}

BoundRate derive(const HullOptima& optima, const HullOptimum& optimum, const RowRates& rates, double noise,
                 const std::string& name, const std::string& kink_before) {
  if (!optimum.found) {
    return {{core::kNan, core::kNan}, why_not_regular(optimum, name)};
  }
  if (!rates.trouble.empty()) {
    return {{core::kNan, core::kNan}, rates.trouble};
  }
  BoundRate result{bound_derivative(optima, optimum, rates.left, rates.right)};
  if (!agree(result.value, noise)) {
    result.why_not = why_not_regular(optimum, name);
    if (result.why_not.empty() && !kink_before.empty()) {
      result.why_not = of_set_before(kink_before);
    } else if (result.why_not.empty()) {
      result.why_not = "a row that holds the bound has a kink, or comes to couple parameters that the log keeps apart";
    }
  }
  return result;
}

BoundRates unknown(std::size_t p, const std::string& why) {
  const std::vector<BoundRate> all(p, {{core::kNan, core::kNan}, of_set_before(why)});
  return {all, all};
}

}  // namespace

std::vector<BoundPass> bound_passes(LogSource& log, const Commissioning& c, double confidence) {
  const RobotAt at{c.model.robot, c.model.filter};
  std::vector<BoundPass> passes;
  std::vector<Interval> sides;
  const auto add = [&](const FeasibleSet& set, const std::vector<std::size_t>& dropped) {
    BoundPass pass{hull_optima(*set.polytope, c.prior), std::exchange(sides, set.hull.sides)};
    TorqueRows rows = rows_of(log, c, at, motion_at(log, c, at, pass.sides, confidence), confidence);
    add_active_rows(pass.optima, rows, dropped);
    passes.push_back(std::move(pass));
  };
  for (const commission::EarlierSet& earlier : c.earlier) {
    add(earlier.set, earlier.dropped);
  }
  add(c.feasible, c.dropped);
  return passes;
}

BoundRates bound_rates(LogSource& log, const Commissioning& c, const std::vector<BoundPass>& passes,
                       const LocalInput& input, double step, double confidence) {
  const Model& model = c.model.model;
  const Beside b = beside(c, input, step);
  BoundRates rates;
  for (const BoundPass& pass : passes) {
    const HullOptima& optima = pass.optima;
    RowsBeside below{{}, b.prior_below}, above{{}, b.prior_above};
    std::string kink;
    if (input.prior && pass.sides.empty()) {
      below.rows = above.rows = active_rows(optima);
    } else {
      MovedSides moved;
      if (!pass.sides.empty()) {
        moved = moved_sides(model, pass.sides, rates, b.step);
      }
      if (!moved.trouble.empty()) {
        rates = unknown(model.p(), moved.trouble);
        continue;
      }
      kink = moved.kink;
      const LogRows wanted = active_rows(optima);
      const auto rows_beside = [&](const RobotAt& at, const std::vector<Interval>& sides, const Box& prior) {
        TorqueRows rows = rows_of(log, c, at, motion_at(log, c, at, sides, confidence), confidence);
        // An input of the prior moves its sides only: the signs that rows count with stay.
        return pick_rows(rows, input.prior ? c.prior : prior, wanted);
      };
      below.rows = rows_beside(b.below, moved.below, b.prior_below);
      above.rows = rows_beside(b.above, moved.above, b.prior_above);
    }
    const auto derived = [&](const HullOptimum& optimum, std::size_t j) {
      const Interval& hull = optima.set.hull().sides[j];
      const double noise = 1e-9 * (hull.upper - hull.lower) / b.reach;
      BoundRate rate = derive(optima, optimum, row_rates(optima, optimum, b.reach, b.step, below, above, kink.empty()),
                              noise, model.parameters[j].name, kink);
      const auto open = [&](const Box& moved, double& side) {
        if (const std::size_t k = opened_sign(optimum, c.prior, moved); k < model.p()) {
          side = core::kNan;
          rate.why_not = fmt::format("the prior's lower side of {} is 0 and is met: below it, a sign is open",
                                     model.parameters[k].physical);
        }
      };
      open(b.prior_below, rate.value.left);
      open(b.prior_above, rate.value.right);
      return rate;
    };
    BoundRates next;
    for (std::size_t j = 0; j < model.p(); ++j) {
      next.lower.push_back(derived(optima.lower[j], j));
      next.upper.push_back(derived(optima.upper[j], j));
    }
    rates = std::move(next);
  }
  return rates;
}

}  // namespace wheelwright::study

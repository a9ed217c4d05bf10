// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/row_rates.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

#include <wheelwright/bounds/slab_rows.hpp>
#include <wheelwright/commission/noise_budget.hpp>

namespace wheelwright {
namespace {

constexpr double kSmooth = 1e-3;  // forward and backward rates of a row, relative
constexpr double kBent = 0.1;     // their difference, in rates of the row's parts per relative change of the input
constexpr double kNoise = 1e-6;   // of a rate, in sizes of the set per relative change of the input
constexpr double kJump = 1e3;     // beyond this, in the same unit, a row jumps

// The active half-space `row` where the input has been moved; nothing where it is gone.
std::optional<HalfSpace> moved(const HalfSpace& row, const RowsBeside& beside) {
  HalfSpace result = row;
  if (row.origin.is_prior) {
    const Interval& side = beside.prior.sides[row.origin.parameter];
    result.b = row.origin.side == Side::upper ? side.upper : -side.lower;
    return result;
  }
  const auto at = beside.rows.find({row.origin.sample, row.origin.output});
  if (at == beside.rows.end()) {
    return std::nullopt;
  }
  return row.origin.side == Side::upper ? at->second.upper : at->second.lower;
}

RowRate rate(const HalfSpace& from, const HalfSpace& to, double step) {
  return {(to.a - from.a) / step, (to.b - from.b) / step};
}

}  // namespace

bool noise_is_declared(const Commissioning& c) {
  return std::ranges::all_of(c.noise, [](const OutputNoise& o) { return o.origin == NoiseOrigin::declared; });
}

Box prior_of(const Robot& robot) { return Box{prior_box(robot, make_model(robot)).bounds}; }

MotionBound motion_at(const Commissioning& c, const RobotAt& at, std::span<const Interval> sides) {
  const Model model = make_model(at.robot);
  const Measurement& measurement = c.model.measurement;
  MotionBound bound = sides.empty() ? MotionBound{} : motion_bound(model, sides);
  bound.limit = coordinate_limit(model, acceleration_limit(at.robot, c.survey, measurement.motion,
                                                           noise_budget(at.robot, measurement).sensors.motion));
  return bound;
}

RegressionStream rows_of(LogSource& log, const Commissioning& c, const RobotAt& at, const MotionBound& motion,
                         double confidence) {
  const Model model = make_model(at.robot);
  const Measurement& measurement = c.model.measurement;
  SignalErrors errors = c.row_errors;
  if (noise_is_declared(c)) {
    errors = propagate(model, at.filter, measurement, noise_budget(at.robot, measurement).sensors,
                       {.mode = c.noise_mode,
                        .confidence = confidence,
                        .rows = static_cast<double>(c.survey.rows),
                        .largest_step = c.survey.largest_step});
    const Eigen::VectorXd effort = errors.motion.effort;
    errors.motion = motion;
    errors.motion.effort = effort;
  }
  FilterDesign filter = at.filter;
  // The same instants, whatever β: an instant that stands on the edge stays.
  filter.settle *= filter.beta / c.model.filter.beta * (1.0 - 1e-9);
  return RegressionStream(log, RegressorFilter(model, filter, measurement, errors));
}

LogRows pick_rows(RegressionSource& rows, const Box& prior, const LogRows& wanted) {
  const SlabRows slabs(prior);
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
      for (const WeightedRow& active : optimum.active) {
        const RowOrigin& origin = active.row.origin;
        if (!origin.is_prior) {
          RowSides& both = rows[{origin.sample, origin.output}];
          (origin.side == Side::upper ? both.upper : both.lower) = active.row;
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
  for (const WeightedRow& active : optimum.active) {
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

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
#include "gap/causes/estimates.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "commission/design/stages.hpp"
#include "core/linear_algebra.hpp"
#include "core/statistics.hpp"

namespace wheelwright::gap {
namespace {

constexpr double kStep = 1e-3;  // of differences, share of a shape

// Rows of all spaces one after the other, in units of their floors.
Eigen::VectorXd stacked(const GapRows& rows, const std::vector<Eigen::VectorXd>& parts) {
  Eigen::Index size = 0;
  for (const RowSpace& space : rows.spaces) {
    size += space.t.size();
  }
  Eigen::VectorXd all = Eigen::VectorXd::Zero(size);
  Eigen::Index at = 0;
  for (std::size_t s = 0; s < rows.spaces.size(); ++s) {
    const Eigen::Index n = rows.spaces[s].t.size();
    if (parts[s].size() > 0) {
      all.segment(at, n) = parts[s] / rows.spaces[s].floor;
    }
    at += n;
  }
  return all;
}

}  // namespace

std::vector<Eigen::VectorXd> column_parts(const GapRows& rows, std::size_t column) {
  std::vector<Eigen::VectorXd> parts;
  for (const RowSpace& space : rows.spaces) {
    parts.push_back(space.columns[column]);
  }
  return parts;
}

CausesModel::CausesModel(const PreparedGap& prepared, const GapProblem& problem, const CauseSet& set, BaseModel base)
    : prepared_(prepared), problem_(problem) {
  for (const std::size_t c : set.members) {
    members_.push_back(problem.table.candidates[c]);
  }
  const std::vector<std::size_t>& theta = base == BaseModel::refitted ? problem.table.base : problem.table.unknown;
  for (const std::size_t column : theta) {
    theta_.push_back(stacked(problem.rows, column_parts(problem.rows, column)));
  }
  std::vector<Eigen::VectorXd> response;
  for (const RowSpace& space : problem.rows.spaces) {
    response.push_back(space.response);
  }
  response_ = stacked(problem.rows, response);
  for (std::size_t k = 0; k < members_.size(); ++k) {
    const Effect& effect = prepared.catalogue[members_[k].effect];
    for (std::size_t s = 0; s < effect.shapes.size(); ++s) {
      if (!effect.shapes[s].discrete) {
        const Interval bounds = shape_bounds(effect.shapes[s], prepared.drive);
        const double sign = effect.shapes[s].both_signs && members_[k].shape[s] < 0.0 ? -1.0 : 1.0;
        free_.push_back({k, s, std::min(sign * bounds.lower, sign * bounds.upper),
                         std::max(sign * bounds.lower, sign * bounds.upper), effect.shapes[s].logarithmic});
      }
    }
  }
  for (const Candidate& member : members_) {
    linear_ += member.unit_coefficient ? 0 : static_cast<Eigen::Index>(member.columns.size());
  }
}

Eigen::VectorXd CausesModel::start() const {
  Eigen::VectorXd shape(shapes());
  for (std::size_t k = 0; k < free_.size(); ++k) {
    shape[static_cast<Eigen::Index>(k)] =
        std::clamp(members_[free_[k].member].shape[free_[k].shape], free_[k].lower, free_[k].upper);
  }
  return shape;
}

std::vector<double> CausesModel::shape_of(std::size_t k, const Eigen::VectorXd& shape) const {
  std::vector<double> own = members_[k].shape;
  for (std::size_t f = 0; f < free_.size(); ++f) {
    if (free_[f].member == k) {
      own[free_[f].shape] = shape[static_cast<Eigen::Index>(f)];
    }
  }
  return own;
}

std::vector<std::vector<Eigen::VectorXd>> CausesModel::parts_of(std::size_t k, const std::vector<double>& shape) const {
  std::vector<std::vector<Eigen::VectorXd>> parts;
  for (const Column& column : prepared_.catalogue[members_[k].effect].columns(prepared_.drive, shape)) {
    parts.push_back(rows_of(prepared_.drive, problem_.rows, column, prepared_.row_options));
  }
  return parts;
}

bool CausesModel::evaluate(const Eigen::VectorXd& shape, bool derivatives, identify::SeparableValues& at) const {
  fill(shape, at.offset, at.columns);
  at.offset_by.clear();
  at.columns_by.clear();
  for (Eigen::Index f = 0; derivatives && f < shapes(); ++f) {
    const double step = kStep * std::max(std::abs(shape[f]), 1e-9);
    Eigen::VectorXd above = shape, below = shape;
    above[f] += step;
    below[f] -= step;
    Eigen::VectorXd offset_above, offset_below;
    Eigen::MatrixXd columns_above, columns_below;
    fill(above, offset_above, columns_above);
    fill(below, offset_below, columns_below);
    at.offset_by.emplace_back((offset_above - offset_below) / (2.0 * step));
    at.columns_by.emplace_back((columns_above - columns_below) / (2.0 * step));
  }
  return true;
}

void CausesModel::fill(const Eigen::VectorXd& shape, Eigen::VectorXd& offset, Eigen::MatrixXd& columns) const {
  offset = Eigen::VectorXd::Zero(response_.size());
  columns.resize(response_.size(), this->columns());
  Eigen::Index at = 0;
  for (const Eigen::VectorXd& column : theta_) {
    columns.col(at++) = column;
  }
  for (std::size_t k = 0; k < members_.size(); ++k) {
    for (const std::vector<Eigen::VectorXd>& part : parts_of(k, shape_of(k, shape))) {
      if (members_[k].unit_coefficient) {
        offset += stacked(problem_.rows, part);
      } else {
        columns.col(at++) = stacked(problem_.rows, part);
      }
    }
  }
}

namespace {

// What the columns themselves leave out (softened signs, second orders), as a share of each number: a share in any
// case, and a part of what the fit leaves above the floor beside what the effect takes off (root mean squares), since
// some of that goes along with the effect's own columns. Measured on an independent world as what the intervals of
// chance alone lack.
constexpr double kForm = 0.01;
constexpr double kMisfit = 0.3;

double form_of(const CandidateTable& table, const CauseSet& set, std::size_t k, BaseModel base, double mean_square) {
  const double own = evaluate_without(table, set, k, base).held_out_error - mean_square;
  return kForm + kMisfit * std::sqrt(std::clamp((mean_square - 1.0) / std::max(own, 1e-300), 0.0, 1.0));
}

// The numbers of one effect and, by differences, how they depend on coefficients and shapes.
std::vector<PhysicalValue> values_of(const Effect& effect, const Eigen::VectorXd& coefficients,
                                     const std::vector<double>& shape) {
  if (effect.physical) {
    return effect.physical({coefficients.data(), static_cast<std::size_t>(coefficients.size())}, shape);
  }
  std::vector<PhysicalValue> values;
  for (std::size_t k = 0; k < effect.parameters.size(); ++k) {
    if (!effect.parameters[k].beside) {
      values.push_back(
          {effect.parameters[k].name, effect.parameters[k].unit, coefficients[static_cast<Eigen::Index>(k)]});
    }
  }
  return values;
}

std::vector<GapEstimate> numbers_of(const Effect& effect, const Eigen::VectorXd& coefficients,
                                    const std::vector<double>& shape, const std::vector<std::size_t>& free_shapes,
                                    const Eigen::MatrixXd& covariance, double t, double form, double time_step) {
  const std::vector<PhysicalValue> values = values_of(effect, coefficients, shape);
  const Eigen::Index n = coefficients.size();
  const auto count = static_cast<Eigen::Index>(values.size());
  Eigen::MatrixXd by = Eigen::MatrixXd::Zero(count, covariance.rows());
  for (Eigen::Index k = 0; k < covariance.rows(); ++k) {
    const double step = 1e-3 * std::sqrt(std::max(covariance(k, k), 0.0));
    if (!(step > 0.0)) {
      continue;
    }
    const auto at = [&](double by_step) {
      Eigen::VectorXd c = coefficients;
      std::vector<double> s = shape;
      (k < n ? c[k] : s[free_shapes[static_cast<std::size_t>(k - n)]]) += by_step;
      return values_of(effect, c, s);
    };
    const std::vector<PhysicalValue> above = at(step), below = at(-step);
    for (Eigen::Index v = 0; v < count; ++v) {
      const auto i = static_cast<std::size_t>(v);
      by(v, k) = (above[i].value - below[i].value) / (2.0 * step);
    }
  }
  std::vector<GapEstimate> numbers;
  for (Eigen::Index v = 0; v < count; ++v) {
    const PhysicalValue& value = values[static_cast<std::size_t>(v)];
    const double half = std::hypot(
        t * std::sqrt(std::max((by.row(v) * covariance * by.row(v).transpose()).value(), 0.0)), form * value.value);
    const Interval more{std::min(value.larger * value.value, 0.0), std::max(value.larger * value.value, 0.0)};
    numbers.push_back(
        {value.name, value.unit, value.value, value.value - half + more.lower, value.value + half + more.upper, false});
  }
  for (std::size_t s = 0; s < effect.shapes.size(); ++s) {
    const bool named = std::any_of(numbers.begin(), numbers.end(),
                                   [&](const GapEstimate& number) { return number.name == effect.shapes[s].name; });
    if (named || effect.shapes[s].beside) {
      continue;
    }
    double half = 0.0;
    for (std::size_t f = 0; f < free_shapes.size(); ++f) {
      if (free_shapes[f] == s) {
        const Eigen::Index k = n + static_cast<Eigen::Index>(f);
        half = std::hypot(t * std::sqrt(std::max(covariance(k, k), 0.0)), form * shape[s],
                          effect.shapes[s].resolution * time_step);
      }
    }
    numbers.push_back({effect.shapes[s].name, effect.shapes[s].unit, shape[s], shape[s] - half, shape[s] + half, true});
  }
  return numbers;
}

Eigen::VectorXd fitted_shape(const CausesModel& model) {
  identify::VariableProjectionOptions options;
  options.start = model.start();
  if (options.start.size() == 0) {
    return options.start;
  }
  options.lower.resize(model.shapes());
  options.upper.resize(model.shapes());
  for (std::size_t k = 0; k < model.free().size(); ++k) {
    options.lower[static_cast<Eigen::Index>(k)] = model.free()[k].lower;
    options.upper[static_cast<Eigen::Index>(k)] = model.free()[k].upper;
  }
  options.most_iterations = 20;
  const identify::SeparableFit fit = identify::variable_projection(model, options);
  return fit.end == identify::SearchEnd::failed ? options.start : fit.shape;
}

}  // namespace

FittedCauses fit_causes(const PreparedGap& prepared, const GapProblem& problem, const CauseSet& set, BaseModel base,
                        const BlockOptions& blocks) {
  const CausesModel model(prepared, problem, set, base);
  const Eigen::VectorXd shape = fitted_shape(model);

  // The model linearised at `shape`: θ, the causes' columns, and the derivatives by the shapes.
  std::vector<RowSpace> spaces;
  for (const RowSpace& space : problem.rows.spaces) {
    RowSpace own;
    own.name = space.name;
    own.t = space.t;
    own.response = space.response;
    own.floor = space.floor;
    spaces.push_back(std::move(own));
  }
  Subset subset;
  const std::vector<std::size_t>& theta = base == BaseModel::refitted ? problem.table.base : problem.table.unknown;
  for (const std::size_t column : theta) {
    subset.columns.push_back(add_column(spaces, column_parts(problem.rows, column)));
    subset.sign.push_back(0);
  }
  std::vector<std::size_t> first_column;
  for (std::size_t k = 0; k < model.members().size(); ++k) {
    first_column.push_back(subset.columns.size());
    const Candidate& member = model.members()[k];
    const std::vector<std::vector<Eigen::VectorXd>> parts = model.parts_of(k, model.shape_of(k, shape));
    for (std::size_t c = 0; c < parts.size(); ++c) {
      if (member.unit_coefficient) {
        subset.fixed.push_back(add_column(spaces, parts[c]));
      } else {
        subset.columns.push_back(add_column(spaces, parts[c]));
        subset.sign.push_back(member.sign[c]);
      }
    }
  }
  BlockGram gram(spaces, blocks);
  BlockFit fit = gram.fit(subset);
  if (shape.size() > 0) {
    for (std::size_t f = 0; f < model.free().size(); ++f) {
      const std::size_t k = model.free()[f].member;
      const double step = 1e-3 * std::max(std::abs(shape[static_cast<Eigen::Index>(f)]), 1e-9);
      Eigen::VectorXd above = shape, below = shape;
      above[static_cast<Eigen::Index>(f)] += step;
      below[static_cast<Eigen::Index>(f)] -= step;
      const auto up = model.parts_of(k, model.shape_of(k, above));
      const auto down = model.parts_of(k, model.shape_of(k, below));
      std::vector<Eigen::VectorXd> derivative(spaces.size());
      for (std::size_t c = 0; c < up.size(); ++c) {
        const double factor = model.members()[k].unit_coefficient
                                  ? 1.0
                                  : fit.coefficients[static_cast<Eigen::Index>(first_column[k] + c)];
        for (std::size_t s = 0; s < spaces.size(); ++s) {
          if (up[c][s].size() == 0) {
            continue;
          }
          const Eigen::VectorXd part = factor * (up[c][s] - down[c][s]) / (2.0 * step);
          derivative[s] = derivative[s].size() > 0 ? Eigen::VectorXd(derivative[s] + part) : part;
        }
      }
      subset.columns.push_back(add_column(spaces, derivative));
      subset.sign.push_back(0);
    }
    gram = BlockGram(spaces, blocks);
    const BlockFit wider = gram.fit(subset);
    const Eigen::Index linear = fit.coefficients.size();
    fit.covariance = wider.covariance;
    fit.coefficients.conservativeResize(linear);
  }

  FittedCauses fitted;
  fitted.freedom = static_cast<double>(gram.blocks()) - 1.0;
  const double t = core::student_quantile_below(fitted.freedom, 0.975);
  fitted.theta = prepared.theta;
  fitted.theta_error = Eigen::VectorXd::Zero(prepared.theta.size());
  for (std::size_t k = 0; k < theta.size(); ++k) {
    const auto j = static_cast<Eigen::Index>(theta[k]);
    const auto i = static_cast<Eigen::Index>(k);
    fitted.theta[j] += fit.coefficients[i];
    fitted.theta_error[j] = std::sqrt(std::max(fit.covariance(i, i), 0.0));
  }
  const auto shapes_begin = static_cast<Eigen::Index>(subset.columns.size() - model.free().size());
  for (std::size_t k = 0; k < model.members().size(); ++k) {
    const Candidate& member = model.members()[k];
    FittedEffect effect{prepared.catalogue[member.effect], model.shape_of(k, shape), {}};
    std::vector<Eigen::Index> index;
    if (!member.unit_coefficient) {
      const auto n = static_cast<Eigen::Index>(member.columns.size());
      effect.coefficients = fit.coefficients.segment(static_cast<Eigen::Index>(first_column[k]), n);
      for (Eigen::Index c = 0; c < n; ++c) {
        index.push_back(static_cast<Eigen::Index>(first_column[k]) + c);
      }
    }
    std::vector<std::size_t> free_shapes;
    for (std::size_t f = 0; f < model.free().size(); ++f) {
      if (model.free()[f].member == k) {
        free_shapes.push_back(model.free()[f].shape);
        index.push_back(shapes_begin + static_cast<Eigen::Index>(f));
      }
    }
    const auto size = static_cast<Eigen::Index>(index.size());
    Eigen::MatrixXd covariance(size, size);
    for (Eigen::Index a = 0; a < size; ++a) {
      for (Eigen::Index b = 0; b < size; ++b) {
        covariance(a, b) = fit.covariance(index[static_cast<std::size_t>(a)], index[static_cast<std::size_t>(b)]);
      }
    }
    std::vector<Interval> intervals;
    for (Eigen::Index c = 0; c < effect.coefficients.size(); ++c) {
      const double half = t * std::sqrt(std::max(covariance(c, c), 0.0));
      intervals.push_back({effect.coefficients[c] - half, effect.coefficients[c] + half});
    }
    fitted.intervals.push_back(std::move(intervals));
    fitted.numbers.push_back(numbers_of(effect.effect, effect.coefficients, effect.shape, free_shapes, covariance, t,
                                        form_of(problem.table, set, k, base, fit.mean_square), prepared.drive.step));
    fitted.effects.push_back(std::move(effect));
  }
  fitted.subset = subset_of(problem.table, set.members, base);
  fitted.coefficients = problem.table.gram->fit(fitted.subset).coefficients;
  return fitted;
}

namespace {

std::size_t continuous_shapes(const Effect& effect) {
  return static_cast<std::size_t>(std::ranges::count(effect.shapes, false, &ShapeParameter::discrete));
}

// The best set that has a candidate of `effect`; null where none has.
const CauseSet* best_with(std::size_t effect, const CandidateTable& table, const std::vector<CauseSet>& sets) {
  const CauseSet* best = nullptr;
  for (const CauseSet& set : sets) {
    const bool has =
        std::ranges::any_of(set.members, [&](std::size_t member) { return table.candidates[member].effect == effect; });
    if (has && (best == nullptr || set.held_out_error < best->held_out_error)) {
      best = &set;
    }
  }
  return best;
}

double error_without(std::size_t effect, const CandidateTable& table, const CauseSet& set) {
  const auto member =
      std::ranges::find_if(set.members, [&](std::size_t c) { return table.candidates[c].effect == effect; });
  const auto k = static_cast<std::size_t>(member - set.members.begin());
  return evaluate_without(table, set, k, BaseModel::refitted).held_out_error;
}

double to_cube(const FreeShape& range, double value) {
  return range.logarithmic ? std::log(value / range.lower) / std::log(range.upper / range.lower)
                           : (value - range.lower) / (range.upper - range.lower);
}

double from_cube(const FreeShape& range, double x) {
  return range.logarithmic ? range.lower * std::pow(range.upper / range.lower, x)
                           : range.lower + x * (range.upper - range.lower);
}

// The set's free shapes that leave least.
Eigen::VectorXd tuned(const CausesModel& model, const TuneOptions& options) {
  const auto shape_at = [&model](std::span<const double> x) {
    Eigen::VectorXd shape(model.shapes());
    for (std::size_t k = 0; k < x.size(); ++k) {
      shape[static_cast<Eigen::Index>(k)] = from_cube(model.free()[k], x[k]);
    }
    return shape;
  };
  const auto left = [&](std::span<const double> x) {
    identify::SeparableValues at;
    model.evaluate(shape_at(x), false, at);
    const Eigen::VectorXd y = model.response() - at.offset;
    const Eigen::VectorXd rotated = core::QrFactors(at.columns).rotate(y);
    return rotated.tail(rotated.size() - at.columns.cols()).squaredNorm() / static_cast<double>(y.size());
  };
  std::vector<double> start;
  for (Eigen::Index k = 0; k < model.shapes(); ++k) {
    start.push_back(std::clamp(to_cube(model.free()[static_cast<std::size_t>(k)], model.start()[k]), 0.0, 1.0));
  }
  design::SearchOptions search;
  search.samples = options.samples;
  search.descents = options.descents;
  search.steps = options.steps;
  search.seed = options.seed;
  search.threads = options.threads;
  return shape_at(design::minimise_over_cube(left, start.size(), {start}, search).x);
}

}  // namespace

void add_tuned_shapes(ShapeGrids& grids, const PreparedGap& prepared, const GapProblem& problem,
                      const std::vector<CauseSet>& looked_at, const TuneOptions& options) {
  for (std::size_t e = 0; e < prepared.catalogue.size(); ++e) {
    if (continuous_shapes(prepared.catalogue[e]) < options.shapes) {
      continue;
    }
    const CauseSet* set = best_with(e, problem.table, looked_at);
    if (set == nullptr || set->held_out_error > (1.0 - options.gain) * error_without(e, problem.table, *set)) {
      continue;
    }
    const CausesModel model(prepared, problem, *set, BaseModel::refitted);
    const Eigen::VectorXd shape = tuned(model, options);
    for (std::size_t k = 0; k < model.members().size(); ++k) {
      if (!prepared.catalogue[model.members()[k].effect].shapes.empty()) {
        grids[model.members()[k].effect].push_back(model.shape_of(k, shape));
      }
    }
  }
}

void add_shapes_with_theta_held(ShapeGrids& grids, const PreparedGap& prepared, const GapProblem& problem,
                                const CauseSet& set) {
  const CandidateTable& table = problem.table;
  for (std::size_t k = 0; k < set.members.size(); ++k) {
    const std::string& name = table.names[table.candidates[set.members[k]].effect];
    for (std::size_t e = 0; e < table.names.size(); ++e) {
      if (table.names[e] != name || continuous_shapes(prepared.catalogue[e]) == 0) {
        continue;
      }
      std::optional<CauseSet> best;
      for (std::size_t c = 0; c < table.candidates.size(); ++c) {
        if (table.candidates[c].effect == e) {
          std::vector<std::size_t> members = set.members;
          members[k] = c;
          CauseSet with = evaluate(table, std::move(members), BaseModel::nominal);
          if (!best || with.held_out_error < best->held_out_error) {
            best = std::move(with);
          }
        }
      }
      if (best) {
        const CausesModel model(prepared, problem, *best, BaseModel::nominal);
        grids[e].push_back(model.shape_of(k, fitted_shape(model)));
      }
    }
  }
}

}  // namespace wheelwright::gap

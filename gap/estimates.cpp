// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/estimates.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>

#include <wheelwright/core/statistics.hpp>
#include <wheelwright/gap/causes_model.hpp>

namespace wheelwright {
namespace {

// What the columns themselves leave out (softened signs, second orders), as a share of each number: a share in any case, and
// a part of what the fit leaves above the floor beside what the effect takes off (root mean squares), since some of that
// goes along with the effect's own columns. Measured on an independent world as what the intervals of chance alone lack.
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
    if (named) {
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

}  // namespace

FittedCauses fit_causes(const PreparedGap& prepared, const GapProblem& problem, const CauseSet& set, BaseModel base,
                        const BlockOptions& blocks) {
  const CausesModel model(prepared, problem, set, base);
  Eigen::VectorXd shape = model.start();
  if (shape.size() > 0) {
    VariableProjectionOptions options;
    options.start = shape;
    options.lower.resize(shape.size());
    options.upper.resize(shape.size());
    for (std::size_t k = 0; k < model.free().size(); ++k) {
      options.lower[static_cast<Eigen::Index>(k)] = model.free()[k].lower;
      options.upper[static_cast<Eigen::Index>(k)] = model.free()[k].upper;
    }
    options.most_iterations = 20;
    const SeparableFit fit = variable_projection(model, options);
    if (fit.end != SearchEnd::failed) {
      shape = fit.shape;
    }
  }

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
  const double t = student_quantile_below(fitted.freedom, 0.975);
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

std::vector<double> shapley_shares(const CandidateTable& table, const CauseSet& set, BaseModel base, double gap) {
  const std::size_t k = set.members.size();
  std::vector<double> error(std::size_t{1} << k);
  for (std::size_t mask = 0; mask < error.size(); ++mask) {
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < k; ++i) {
      if ((mask >> i & 1U) != 0U) {
        members.push_back(set.members[i]);
      }
    }
    error[mask] = evaluate(table, std::move(members), base).held_out_error;
  }
  std::vector<double> shares(k, 0.0);
  for (std::size_t i = 0; i < k; ++i) {
    for (std::size_t mask = 0; mask < error.size(); ++mask) {
      if ((mask >> i & 1U) != 0U) {
        continue;
      }
      const auto before = static_cast<double>(std::popcount(mask));
      const auto all = static_cast<double>(k);
      // before! (k − before − 1)! / k!
      const double weight = std::exp(std::lgamma(before + 1.0) + std::lgamma(all - before) - std::lgamma(all + 1.0));
      shares[i] += weight * (error[mask] - error[mask | std::size_t{1} << i]) / std::max(gap, 1e-300);
    }
  }
  return shares;
}

}  // namespace wheelwright

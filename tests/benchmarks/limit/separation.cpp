// SPDX-License-Identifier: Apache-2.0
#include "tests/benchmarks/limit/separation.hpp"

#include <algorithm>
#include <cmath>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic"
#include <ClpSimplex.hpp>
#pragma GCC diagnostic pop

#include "core/check.hpp"

namespace wheelwright::bench {
namespace {

constexpr double kLeastShare = -1.0;
constexpr double kTolerance = 1e-9;

// Columns of a program, one after the other.
class Columns {
 public:
  void entry(std::size_t row, double value) {
    if (value != 0.0) {
      row_.push_back(static_cast<int>(row));
      value_.push_back(value);
    }
  }
  void close(double lower, double upper, double cost = 0.0) {
    start_.push_back(static_cast<CoinBigIndex>(row_.size()));
    lower_.push_back(lower);
    upper_.push_back(upper);
    cost_.push_back(cost);
  }
  [[nodiscard]] int size() const { return static_cast<int>(lower_.size()); }
  void load(ClpSimplex& model, const std::vector<double>& row_lower, const std::vector<double>& row_upper) const {
    model.loadProblem(size(), static_cast<int>(row_lower.size()), start_.data(), row_.data(), value_.data(),
                      lower_.data(), upper_.data(), cost_.data(), row_lower.data(), row_upper.data());
  }

 private:
  std::vector<CoinBigIndex> start_{0};
  std::vector<int> row_;
  std::vector<double> value_, lower_, upper_, cost_;
};

}  // namespace

Separation SeparationSolver::solve(const SeparationProblem& problem) {
  const Polytope& set = *problem.set;
  const auto rows = static_cast<std::size_t>(problem.healthy->rows());
  const std::size_t p = set.dimension();
  check::that(static_cast<std::size_t>(problem.healthy->cols()) == p &&
                  static_cast<std::size_t>(problem.deviation.size()) == rows,
              "separation", "a matrix with a column for each parameter and a deviation for each of its rows");
  ++programs_;
  const Eigen::Map<const Eigen::VectorXd> centre(set.centre().data(), static_cast<Eigen::Index>(p));
  const double scale = std::max(problem.deviation.cwiseAbs().maxCoeff(), 1e-300);
  const std::size_t facets = set.facets().size(), sets = (problem.fixed ? 0u : 1u) + (problem.faulty ? 1u : 0u);

  std::vector<double> magnitude(p), facet_scale(facets, 0.0);
  for (std::size_t j = 0; j < p; ++j) {
    const Interval side = set.hull().sides[j];
    magnitude[j] = std::max({std::abs(side.lower), std::abs(side.upper), 1e-300});
    for (std::size_t f = 0; f < facets; ++f) {
      facet_scale[f] = std::max(
          facet_scale[f], 0.5 * (side.upper - side.lower) * std::abs(set.facets()[f].a[static_cast<Eigen::Index>(j)]));
    }
  }
  for (double& s : facet_scale) {
    s = s > 0.0 ? s : 1.0;
  }
  // A disturbance that θ_j bounds is x = t − θ_j with t >= 0 and a row t − 2(θ_j − θ̂_j) <= 2θ̂_j; where θ is fixed, it
  // is bounded by a number.
  std::vector<std::size_t> bounded;
  core::RowMatrix healthy = *problem.healthy;
  Eigen::VectorXd right = problem.deviation;
  for (std::size_t d = 0; d < problem.disturbances.size() && !problem.fixed; ++d) {
    const Disturbance& disturbance = problem.disturbances[d];
    if (disturbance.parameter != Disturbance::kNone) {
      bounded.push_back(d);
      for (const auto& [row, weight] : disturbance.entries) {
        const auto r = static_cast<Eigen::Index>(row), j = static_cast<Eigen::Index>(disturbance.parameter);
        healthy(r, j) -= weight;
        right[r] += weight * centre[j];
      }
    }
  }
  right /= scale;

  Columns columns;
  std::size_t facet_row = rows;
  const std::size_t bounded_row = rows + sets * facets;
  const auto parameters = [&](const core::RowMatrix& matrix, double sign, bool bounds) {
    for (std::size_t j = 0; j < p; ++j) {
      const Interval side = set.hull().sides[j];
      const double unit = 0.5 * (side.upper - side.lower);
      for (std::size_t r = 0; r < rows; ++r) {
        columns.entry(r, sign * unit * matrix(static_cast<Eigen::Index>(r), static_cast<Eigen::Index>(j)) / scale);
      }
      for (std::size_t f = 0; f < facets; ++f) {
        columns.entry(facet_row + f, unit * set.facets()[f].a[static_cast<Eigen::Index>(j)] / facet_scale[f]);
      }
      for (std::size_t q = 0; bounds && q < bounded.size(); ++q) {
        if (problem.disturbances[bounded[q]].parameter == j) {
          columns.entry(bounded_row + q, -2.0 * unit / magnitude[j]);
        }
      }
      const double at = set.centre()[j];
      columns.close(unit > 0.0 ? (side.lower - at) / unit : 0.0, unit > 0.0 ? (side.upper - at) / unit : 0.0);
    }
    facet_row += facets;
  };
  if (problem.fixed) {
    right -= healthy * (problem.member - centre) / scale;
  } else {
    parameters(healthy, 1.0, true);
  }
  const int first_faulty = columns.size();
  if (problem.faulty) {
    parameters(*problem.faulty, -1.0, false);
  }
  std::size_t q = 0;
  for (const Disturbance& disturbance : problem.disturbances) {
    const bool by_theta = disturbance.parameter != Disturbance::kNone;
    const double unit = !by_theta       ? 1.0
                        : problem.fixed ? problem.member[static_cast<Eigen::Index>(disturbance.parameter)]
                                        : magnitude[disturbance.parameter];
    for (const auto& [row, weight] : disturbance.entries) {
      columns.entry(row, unit * weight / scale);
    }
    if (by_theta && !problem.fixed) {
      columns.entry(bounded_row + q++, 1.0);
      columns.close(0.0, COIN_DBL_MAX);
    } else {
      columns.close(-1.0, 1.0);
    }
  }
  for (std::size_t r = 0; r < rows; ++r) {
    columns.entry(r, problem.deviation[static_cast<Eigen::Index>(r)] / scale);
  }
  columns.close(kLeastShare, 1.0, 1.0);

  std::vector<double> row_lower(right.data(), right.data() + right.size()), row_upper = row_lower;
  for (std::size_t k = 0; k < sets; ++k) {
    for (std::size_t f = 0; f < facets; ++f) {
      const bounds::HalfSpace& facet = set.facets()[f];
      row_lower.push_back(-COIN_DBL_MAX);
      row_upper.push_back(std::max(0.0, facet.b - facet.a.dot(centre)) / facet_scale[f]);
    }
  }
  for (const std::size_t d : bounded) {
    const std::size_t j = problem.disturbances[d].parameter;
    row_lower.push_back(-COIN_DBL_MAX);
    row_upper.push_back(2.0 * set.centre()[j] / magnitude[j]);
  }
  ClpSimplex model;
  model.setLogLevel(0);
  columns.load(model, row_lower, row_upper);
  const auto size = static_cast<std::size_t>(columns.size()) + row_lower.size();
  if (basis_.size() == size) {
    model.copyinStatus(basis_.data());
  }
  // Rows and columns are of size about one already. With scaling of its own CLP takes bases for optimal that are not.
  model.scaling(0);
  model.setPrimalTolerance(kTolerance);
  model.setDualTolerance(kTolerance);
  model.dual();
  if (model.status() != 0 || model.secondaryStatus() != 0) {
    model.primal();
  }
  Separation answer;
  answer.solved = model.status() == 0;
  if (!answer.solved) {
    return answer;
  }
  basis_.assign(model.statusArray(), model.statusArray() + size);
  const double* x = model.primalColumnSolution();
  const auto member = [&](int from) {
    Eigen::VectorXd theta = centre;
    for (std::size_t j = 0; j < p; ++j) {
      const Interval side = set.hull().sides[j];
      theta[static_cast<Eigen::Index>(j)] += 0.5 * (side.upper - side.lower) * x[from + static_cast<int>(j)];
    }
    return theta;
  };
  answer.share = x[columns.size() - 1];
  answer.theta = problem.fixed ? problem.member : member(0);
  answer.faulty = problem.faulty ? member(first_faulty) : Eigen::VectorXd(centre);
  answer.weights = Eigen::Map<const Eigen::VectorXd>(model.dualRowSolution(), static_cast<Eigen::Index>(rows)) / scale;
  return answer;
}

}  // namespace wheelwright::bench

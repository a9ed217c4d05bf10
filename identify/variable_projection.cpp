// SPDX-License-Identifier: Apache-2.0
#include "identify/variable_projection.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <ceres/ceres.h>
#include <Eigen/Core>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"
#include "core/statistics.hpp"
#include "identify/moments.hpp"
#include "identify/noise_level.hpp"

namespace wheelwright::identify {

using core::kInfinity;

namespace {

constexpr double kHopeless = 1e6;  // half width of an interval over the estimate, without bounds to judge by

// The linear problem at one ω, weighted, and its solution.
struct Projection {
  SeparableValues at;
  Eigen::VectorXd scale;  // lengths of the columns
  core::PivotedQr qr;
  int rank = 0;
  Eigen::VectorXd linear, residual;

  // v − Φ Φ⁺ v
  [[nodiscard]] Eigen::VectorXd perpendicular(const Eigen::VectorXd& v) const {
    if (at.columns.cols() == 0) {
      return v;
    }
    Eigen::VectorXd c = qr.rotate(v);
    c.head(rank).setZero();
    return qr.rotate_back(c);
  }
  // (Φ⁺)ᵀ v
  [[nodiscard]] Eigen::VectorXd pseudo_transposed(const Eigen::VectorXd& v) const {
    const Eigen::VectorXd permuted = v.cwiseQuotient(scale)(qr.order().head(rank));
    Eigen::VectorXd c = Eigen::VectorXd::Zero(at.columns.rows());
    c.head(rank) = core::solve_lower(qr.R(rank).transpose(), permuted);
    return qr.rotate_back(c);
  }
};

bool finite(const SeparableValues& at, bool derivatives) {
  bool good = at.offset.allFinite() && at.columns.allFinite();
  if (derivatives) {
    for (const auto& d : at.offset_by) good = good && d.allFinite();
    for (const auto& d : at.columns_by) good = good && d.allFinite();
  }
  return good;
}

class Problem {
 public:
  Problem(const SeparableModel& model, const Eigen::VectorXd& weights, double rank_tolerance)
      : model_(&model), rank_tolerance_(rank_tolerance), y_(model.response()) {
    check::that(model.shapes() >= 1, "shape parameters", "at least 1");
    const auto n = static_cast<Eigen::Index>(model.outputs());
    check::that(y_.size() > 0 && y_.size() % n == 0, "response", "whole instants, at least one");
    check::that(y_.allFinite(), "response", "finite numbers");
    check::that(weights.size() == 0 || weights.size() == n, "weights", "one for each output");
    row_weights_ = Eigen::VectorXd::Ones(y_.size());
    for (Eigen::Index i = 0; i < weights.size(); ++i) {
      check::positive(weights[i], "weight");
      for (Eigen::Index k = i; k < y_.size(); k += n) {
        row_weights_[k] = weights[i];
      }
    }
    y_.array() *= row_weights_.array();
  }

  [[nodiscard]] Eigen::Index rows() const { return y_.size(); }
  [[nodiscard]] const SeparableModel& model() const { return *model_; }

  [[nodiscard]] std::optional<Projection> project(const Eigen::VectorXd& shape, bool derivatives) const {
    Projection p;
    if (!model_->evaluate(shape, derivatives, p.at) || !finite(p.at, derivatives)) {
      return std::nullopt;
    }
    check::that(p.at.columns.rows() == rows() && p.at.columns.cols() == model_->columns() &&
                    (p.at.offset.size() == 0 || p.at.offset.size() == rows()),
                "separable model", "values of the announced shape");
    p.at.columns.array().colwise() *= row_weights_.array();
    for (auto& d : p.at.columns_by) d.array().colwise() *= row_weights_.array();
    for (auto& d : p.at.offset_by) d.array() *= row_weights_.array();
    p.residual = y_;
    if (p.at.offset.size() > 0) {
      p.residual.array() -= row_weights_.array() * p.at.offset.array();
    }
    p.linear = Eigen::VectorXd::Zero(model_->columns());
    if (model_->columns() == 0) {
      return p;
    }
    p.scale = p.at.columns.colwise().norm();
    for (double& s : p.scale) s = s > 0.0 ? s : 1.0;
    p.qr = core::PivotedQr(p.at.columns * p.scale.cwiseInverse().asDiagonal(), rank_tolerance_);
    p.rank = static_cast<int>(p.qr.rank());
    p.linear = p.qr.solve(p.residual).cwiseQuotient(p.scale);
    // One step of refinement: shapes at which columns are nearly alike (sums of exponentials) want it.
    const Eigen::VectorXd left = p.residual - p.at.columns * p.linear;
    p.linear += p.qr.solve(left).cwiseQuotient(p.scale);
    p.residual -= p.at.columns * p.linear;
    return p;
  }

  // ∂(f + Φθ)/∂ω_k at fixed θ.
  [[nodiscard]] static Eigen::VectorXd direct(const Projection& p, std::size_t k) {
    Eigen::VectorXd d = Eigen::VectorXd::Zero(p.residual.size());
    if (!p.at.offset_by.empty()) d += p.at.offset_by[k];
    if (p.linear.size() > 0) d += p.at.columns_by[k] * p.linear;
    return d;
  }

 private:
  const SeparableModel* model_;
  double rank_tolerance_;
  Eigen::VectorXd y_;
  Eigen::VectorXd row_weights_;
};

// Jacobian of the projected residual by the shapes, N × q: Golub and Pereyra (1973), or Kaufman (1975).
Eigen::MatrixXd projected_jacobian(const Projection& p, bool full) {
  const auto q = static_cast<Eigen::Index>(std::max(p.at.columns_by.size(), p.at.offset_by.size()));
  Eigen::MatrixXd J(p.residual.size(), q);
  for (Eigen::Index k = 0; k < q; ++k) {
    const auto at = static_cast<std::size_t>(k);
    J.col(k) = -p.perpendicular(Problem::direct(p, at));
    if (full && p.linear.size() > 0) {
      J.col(k) -= p.pseudo_transposed(p.at.columns_by[at].transpose() * p.residual);
    }
  }
  return J;
}

class ProjectedCost final : public ceres::CostFunction {
 public:
  ProjectedCost(const Problem& problem, bool full) : problem_(&problem), full_(full) {
    set_num_residuals(static_cast<int>(problem.rows()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(problem.model().shapes()));
  }
  bool Evaluate(const double* const* parameters, double* residuals, double** jacobians) const override {
    const Eigen::Index q = problem_->model().shapes();
    const Eigen::VectorXd shape = Eigen::Map<const Eigen::VectorXd>(parameters[0], q);
    const bool derivatives = jacobians != nullptr && jacobians[0] != nullptr;
    const auto p = problem_->project(shape, derivatives);
    if (!p) {
      return false;
    }
    const Eigen::Index rows = problem_->rows();
    Eigen::Map<Eigen::VectorXd>(residuals, rows) = p->residual;
    bool good = p->residual.allFinite();
    if (derivatives && good) {
      const Eigen::MatrixXd J = projected_jacobian(*p, full_);
      for (Eigen::Index i = 0; i < rows; ++i) {
        Eigen::Map<Eigen::RowVectorXd>(jacobians[0] + i * q, q) = J.row(i);
      }
      good = J.allFinite();
    }
    return good;
  }

 private:
  const Problem* problem_;
  bool full_;
};

Eigen::VectorXd best_of_grid(const Problem& problem, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper,
                             int scan) {
  const Eigen::Index q = lower.size();
  std::vector<int> at(static_cast<std::size_t>(q), 0);
  Eigen::VectorXd best = 0.5 * (lower + upper);
  double least = kInfinity;
  for (bool more = true; more;) {
    Eigen::VectorXd shape(q);
    for (Eigen::Index k = 0; k < q; ++k) {
      shape[k] = lower[k] + (upper[k] - lower[k]) * at[static_cast<std::size_t>(k)] / (scan - 1);
    }
    const auto p = problem.project(shape, false);
    if (p && p->residual.squaredNorm() < least) {
      least = p->residual.squaredNorm();
      best = shape;
    }
    more = false;
    for (auto& digit : at) {
      if (++digit < scan) {
        more = true;
        break;
      }
      digit = 0;
    }
  }
  return best;
}

Eigen::VectorXd bound_or(const Eigen::VectorXd& bound, Eigen::Index q, double otherwise) {
  return bound.size() == 0 ? Eigen::VectorXd::Constant(q, otherwise) : bound;
}

SearchEnd search(const Problem& problem, const VariableProjectionOptions& options, const Eigen::VectorXd& lower,
                 const Eigen::VectorXd& upper, SeparableFit& fit) {
  ceres::Problem outer;
  Eigen::VectorXd shape = fit.shape;
  outer.AddResidualBlock(new ProjectedCost(problem, options.full_jacobian), nullptr, shape.data());
  for (Eigen::Index k = 0; k < shape.size(); ++k) {
    if (std::isfinite(lower[k])) outer.SetParameterLowerBound(shape.data(), static_cast<int>(k), lower[k]);
    if (std::isfinite(upper[k])) outer.SetParameterUpperBound(shape.data(), static_cast<int>(k), upper[k]);
  }
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  solver.max_num_iterations = options.most_iterations;
  solver.function_tolerance = options.flat;
  solver.gradient_tolerance = solver.parameter_tolerance = std::numeric_limits<double>::epsilon();
  solver.max_num_consecutive_invalid_steps = 20;
  solver.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &outer, &summary);
  fit.iterations = static_cast<int>(summary.iterations.size());
  if (shape.allFinite()) {
    fit.shape = shape;
  }
  switch (summary.termination_type) {
    case ceres::CONVERGENCE: return SearchEnd::converged;
    case ceres::NO_CONVERGENCE: return SearchEnd::iterations;
    default: return SearchEnd::failed;
  }
}

// The cost is flat to rounding within √ε of its minimum: Gauss-Newton steps on the gradient alone find the digits
// below.
void polish(const Problem& problem, const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, SeparableFit& fit) {
  constexpr int kMost = 30;
  constexpr int kPatience = 4;
  double last = kInfinity;
  Eigen::VectorXd shape = fit.shape;
  for (int k = 0, best = 0; k < kMost && k - best < kPatience; ++k) {
    const bool inside = (shape.array() > lower.array()).all() && (shape.array() < upper.array()).all();
    const auto at = inside ? problem.project(shape, true) : std::nullopt;
    if (!at || !at->residual.allFinite()) {
      return;
    }
    const Eigen::MatrixXd J = projected_jacobian(*at, true);
    const Eigen::VectorXd length = J.colwise().norm();
    if (!J.allFinite() || !(length.array() > 0.0).all()) {
      return;
    }
    const double gradient = (J.transpose() * at->residual).cwiseQuotient(length).norm();
    if (gradient < last) {
      last = gradient;
      best = k;
      fit.shape = shape;
    }
    shape -= Eigen::VectorXd(J.colPivHouseholderQr().solve(at->residual));
  }
}

// Inverse of JᵀJ over the columns marked `used`, zero elsewhere; columns that others make up are unmarked.
Eigen::MatrixXd inverse_gram(const Eigen::MatrixXd& J, double tolerance, std::vector<bool>& used) {
  std::vector<Eigen::Index> pick;
  for (std::size_t j = 0; j < used.size(); ++j) {
    if (used[j]) pick.push_back(static_cast<Eigen::Index>(j));
  }
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Zero(J.cols(), J.cols());
  const auto m = static_cast<Eigen::Index>(pick.size());
  if (m == 0) {
    return inverse;
  }
  Eigen::MatrixXd K(J.rows(), m);
  Eigen::VectorXd scale(m);
  for (Eigen::Index j = 0; j < m; ++j) {
    const double length = J.col(pick[static_cast<std::size_t>(j)]).norm();
    scale[j] = length > 0.0 ? length : 1.0;
    K.col(j) = J.col(pick[static_cast<std::size_t>(j)]) / scale[j];
  }
  const core::PivotedQr qr(core::QrFactors(K).R(), tolerance);
  const Eigen::Index rank = qr.rank();
  if (rank < m) {
    for (Eigen::Index j = rank; j < m; ++j) {
      used[static_cast<std::size_t>(pick[static_cast<std::size_t>(qr.order()[j])])] = false;
    }
    return inverse_gram(J, tolerance, used);
  }
  Eigen::MatrixXd root(m, m);
  root(qr.order(), Eigen::all) = core::solve_upper(qr.R(m), Eigen::MatrixXd::Identity(m, m));
  const Eigen::MatrixXd gram = root * root.transpose();
  for (Eigen::Index a = 0; a < m; ++a) {
    for (Eigen::Index b = 0; b < m; ++b) {
      inverse(pick[static_cast<std::size_t>(a)], pick[static_cast<std::size_t>(b)]) =
          gram(a, b) / (scale[a] * scale[b]);
    }
  }
  return inverse;
}

// Fills covariances, standard errors and states.
void judge(const Problem& problem, const Projection& at, const VariableProjectionOptions& options,
           const Eigen::VectorXd& lower, const Eigen::VectorXd& upper, SeparableFit& fit) {
  const Eigen::Index q = fit.shape.size();
  const Eigen::Index p = fit.linear.size();
  const Eigen::Index rows = problem.rows();
  Eigen::MatrixXd J(rows, q + p);
  for (Eigen::Index k = 0; k < q; ++k) {
    J.col(k) = Problem::direct(at, static_cast<std::size_t>(k));
  }
  J.rightCols(p) = at.at.columns;
  fit.state.assign(static_cast<std::size_t>(q), ShapeState::identified);
  std::vector<bool> used(static_cast<std::size_t>(q + p), true);
  for (Eigen::Index k = 0; k < q; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double slope = -J.col(k).dot(at.residual);  // of half the cost; θ is at its minimum
    if (fit.shape[k] <= lower[k] && slope > 0.0) {
      fit.state[i] = ShapeState::at_lower;
    } else if (fit.shape[k] >= upper[k] && slope < 0.0) {
      fit.state[i] = ShapeState::at_upper;
    }
    used[i] = fit.state[i] == ShapeState::identified;
  }
  std::vector<bool> wanted = used;
  const auto instants = rows / static_cast<Eigen::Index>(problem.model().outputs());
  BlockSums scores(static_cast<std::size_t>(q + p));
  const auto n = static_cast<Eigen::Index>(problem.model().outputs());
  for (Eigen::Index k = 0; k < instants; ++k) {
    scores.add(J.middleRows(k * n, n).transpose() * at.residual.segment(k * n, n));
  }
  const LongRunCovariance spread = long_run_covariance(scores);
  fit.freedom = spread.freedom;
  const double t95 = fit.freedom > 0.0 ? core::student_quantile(0.95, fit.freedom) : kInfinity;

  const auto fill = [&] {
    const Eigen::MatrixXd inverse = inverse_gram(J, options.rank_tolerance, used);
    fit.covariance = inverse * spread.matrix * inverse;
    const auto free = static_cast<double>(rows - std::count(used.begin(), used.end(), true));
    fit.covariance_if_independent = free > 0.0 ? Eigen::MatrixXd(inverse * (fit.weighted_rss / free))
                                               : Eigen::MatrixXd::Constant(q + p, q + p, kInfinity);
  };
  fill();
  // A shape whose interval is wider than its bounds is given up, and the others judged at its value.
  bool again = false;
  for (Eigen::Index k = 0; k < q; ++k) {
    const auto i = static_cast<std::size_t>(k);
    if (!wanted[i]) {
      continue;
    }
    const double half = t95 * std::sqrt(fit.covariance(k, k));
    const bool bounded = std::isfinite(lower[k]) && std::isfinite(upper[k]);
    const double widest = bounded ? 0.5 * (upper[k] - lower[k]) : kHopeless * std::abs(fit.shape[k]);
    if (!used[i] || !(half <= widest)) {
      fit.state[i] = ShapeState::flat;
      again = again || used[i];
      used[i] = false;
    }
  }
  if (again) {
    fill();
  }
  fit.standard_error = fit.covariance.diagonal().cwiseSqrt();
  for (Eigen::Index j = 0; j < q + p; ++j) {
    const auto i = static_cast<std::size_t>(j);
    if (!used[i] && (j >= q || fit.state[i] == ShapeState::flat)) {
      fit.standard_error[j] = kInfinity;
    }
  }
}

}  // namespace

SeparableFit variable_projection(const SeparableModel& model, const VariableProjectionOptions& options) {
  const Problem problem(model, options.weights, options.rank_tolerance);
  const Eigen::Index q = model.shapes();
  check::that(options.lower.size() == 0 || options.lower.size() == q, "lower", "one for each shape parameter");
  check::that(options.upper.size() == 0 || options.upper.size() == q, "upper", "one for each shape parameter");
  check::that(options.start.size() == 0 || options.start.size() == q, "start", "one for each shape parameter");
  check::that(options.most_iterations > 0, "most_iterations", "a number > 0");
  check::that(options.scan >= 2, "scan", "a number >= 2");
  check::positive(options.rank_tolerance, "rank_tolerance");
  check::positive(options.flat, "flat");
  const Eigen::VectorXd lower = bound_or(options.lower, q, -kInfinity);
  const Eigen::VectorXd upper = bound_or(options.upper, q, kInfinity);
  check::that((lower.array() < upper.array()).all(), "bounds of a shape", "lower < upper");
  SeparableFit fit;
  if (options.start.size() > 0) {
    check::that(options.start.allFinite() && (options.start.array() >= lower.array()).all() &&
                    (options.start.array() <= upper.array()).all(),
                "start", "finite numbers within the bounds");
    fit.shape = options.start;
  } else {
    check::that(lower.allFinite() && upper.allFinite(), "bounds of a shape", "finite numbers where there is no start");
    fit.shape = best_of_grid(problem, lower, upper, options.scan);
  }
  fit.state.assign(static_cast<std::size_t>(q), ShapeState::flat);
  fit.linear = Eigen::VectorXd::Zero(model.columns());
  fit.standard_error = Eigen::VectorXd::Constant(q + model.columns(), kInfinity);
  fit.covariance = fit.covariance_if_independent = Eigen::MatrixXd::Zero(q + model.columns(), q + model.columns());
  if (!problem.project(fit.shape, true)) {
    return fit;
  }
  fit.end = search(problem, options, lower, upper, fit);
  if (fit.end == SearchEnd::converged) {
    polish(problem, lower, upper, fit);
  }
  const auto at = problem.project(fit.shape, true);
  if (!at) {
    fit.end = SearchEnd::failed;
    return fit;
  }
  fit.linear = at->linear;
  fit.rank = at->rank;
  fit.weighted_rss = at->residual.squaredNorm();
  judge(problem, *at, options, lower, upper, fit);
  return fit;
}

std::vector<CostPoint> cost_curve(const SeparableModel& model, const Eigen::VectorXd& shape, std::size_t which,
                                  double lower, double upper, std::size_t points, const Eigen::VectorXd& weights) {
  check::that(shape.size() == model.shapes() && shape.allFinite(), "shape", "one finite number for each parameter");
  check::that(which < static_cast<std::size_t>(shape.size()), "which", "a shape parameter's number");
  check::that(points >= 2, "points", "at least 2");
  check::that(check::finite(lower, "lower") < check::finite(upper, "upper"), "cost curve", "lower < upper");
  const Problem problem(model, weights, VariableProjectionOptions{}.rank_tolerance);
  std::vector<CostPoint> curve(points);
  Eigen::VectorXd at = shape;
  for (std::size_t k = 0; k < points; ++k) {
    at[static_cast<Eigen::Index>(which)] = curve[k].shape =
        lower + (upper - lower) * static_cast<double>(k) / static_cast<double>(points - 1);
    if (const auto p = problem.project(at, false)) {
      curve[k].weighted_rss = p->residual.squaredNorm();
    }
  }
  return curve;
}

}  // namespace wheelwright::identify

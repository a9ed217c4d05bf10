// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/inference/constrained.hpp>

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/limits.hpp>
#include <wheelwright/core/linear_algebra.hpp>
#include <wheelwright/inference/nonnegative_least_squares.hpp>

namespace wheelwright {
namespace {

/// The problem in scaled columns x = D⁻¹θ and constraints of unit length: min ‖Rx − c‖ subject to Ax <= b.
struct Scaled {
  Eigen::MatrixXd R;
  Eigen::VectorXd c;
  Eigen::VectorXd column;  // θ = column ∘ x
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  Eigen::VectorXd length;  // of each constraint before it was scaled

  Scaled(const LeastSquares& rows, const std::vector<LinearConstraint>& constraints) {
    const Eigen::MatrixXd factor = rows.factor();
    const Eigen::Index p = factor.cols() - 1;
    R = factor.topLeftCorner(p, p);
    c = factor.col(p).head(p);
    column = R.colwise().norm().transpose();
    for (double& s : column) {
      s = s > 0.0 ? 1.0 / s : 1.0;
    }
    R = R * column.asDiagonal();
    const auto count = static_cast<Eigen::Index>(constraints.size());
    A.resize(count, p);
    b.resize(count);
    length.resize(count);
    for (Eigen::Index i = 0; i < count; ++i) {
      const LinearConstraint& constraint = constraints[static_cast<std::size_t>(i)];
      check::that(constraint.a.size() == p, "constraint '" + constraint.name + "'", "a coefficient for each parameter");
      check::that(constraint.a.allFinite() && std::isfinite(constraint.b), "constraint '" + constraint.name + "'",
                  "finite numbers");
      const Eigen::RowVectorXd a = constraint.a.transpose() * column.asDiagonal();
      length[i] = a.norm();
      check::that(length[i] > 0.0, "constraint '" + constraint.name + "'", "a coefficient other than 0");
      A.row(i) = a / length[i];
      b[i] = constraint.b / length[i];
    }
  }

  /// Where the rows leave directions free, a pull to 0 too weak to be seen in the others.
  void pull(double strength) {
    const Eigen::Index p = R.cols();
    Eigen::MatrixXd stack(2 * p, p + 1);
    stack << R, c, strength * Eigen::MatrixXd::Identity(p, p), Eigen::VectorXd::Zero(p);
    const Eigen::MatrixXd folded = QrFactors(stack).R().topRows(p);
    R = folded.leftCols(p);
    c = folded.col(p);
  }
};

/// min ‖Rx − c‖ subject to Ax = b with independent rows, and its multipliers.
struct Equality {
  Eigen::VectorXd x, multiplier;

  Equality(const Scaled& s, const Eigen::MatrixXd& A, const Eigen::VectorXd& b) {
    const Eigen::Index p = s.R.cols(), m = A.rows();
    if (m == 0) {
      x = s.R.colPivHouseholderQr().solve(s.c);
      multiplier.resize(0);
      return;
    }
    const QrFactors qr(A.transpose());
    const Eigen::MatrixXd Q = qr.Q();
    const Eigen::MatrixXd U = qr.R();
    const Eigen::VectorXd held = solve_lower(U.transpose(), b);
    x = Q.leftCols(m) * held;
    if (m < p) {
      const Eigen::MatrixXd moving = s.R * Q.rightCols(p - m);
      x += Q.rightCols(p - m) * least_squares_solution(moving, s.c - s.R * x);
    }
    const Eigen::VectorXd pull = 2.0 * s.R.transpose() * (s.c - s.R * x);
    multiplier = solve_upper(U, Q.leftCols(m).transpose() * pull);
  }
};

std::string sentence(const LinearConstraint& constraint, const ActiveConstraint& active) {
  const std::string asks = constraint.asks.empty() ? "a value beyond a constraint" : constraint.asks;
  std::string words = active.multiplier > 0.0 ? fmt::format("the log asks for {}: {} binds", asks, constraint.name)
                                              : fmt::format("{} is met exactly without binding", constraint.name);
  if (active.multiplier > 0.0 && active.excess_in_errors > 0.0) {
    words += active.excess_in_errors < 2.0
                 ? fmt::format(" (by {:.1f} standard errors only: noise may do that)", active.excess_in_errors)
                 : fmt::format(" (by {:.1f} standard errors: the model, its scales or the constraint are in doubt)",
                               active.excess_in_errors);
  }
  return words;
}

}  // namespace

ConstrainedFit constrained_least_squares(const LeastSquares& rows, const std::vector<LinearConstraint>& constraints,
                                         const Eigen::MatrixXd& covariance) {
  const LeastSquaresFit free = rows.solve();
  Scaled s(rows, constraints);
  const Eigen::Index p = s.R.cols(), m = s.A.rows();
  check::that(covariance.size() == 0 || (covariance.rows() == p && covariance.cols() == p), "covariance", "p × p");

  ConstrainedFit fit;
  fit.free_estimate = free.estimate;
  fit.free_rss = free.weighted_rss;
  const Eigen::MatrixXd R = s.R;
  const Eigen::VectorXd c = s.c;
  if (free.rank < p) {
    fit.status = ConstrainedStatus::undetermined;
    s.pull(1e-7);
  }

  // Least distance: with w = Rx − c, min ‖w‖ subject to −AR⁻¹w >= AR⁻¹c − b; its dual is the distance of the last unit
  // vector from the cone of the columns of [−R⁻ᵀAᵀ; h].
  std::vector<Eigen::Index> working;
  if (m > 0) {
    const Eigen::MatrixXd G = -solve_lower(s.R.transpose(), s.A.transpose()).transpose();  // m × p
    const Eigen::VectorXd h = -G * s.c - s.b;
    const double reach = std::max(h.cwiseAbs().maxCoeff() / G.rowwise().norm().maxCoeff(), 1e-300);
    Eigen::MatrixXd E(p + 1, m);
    E.topRows(p) = G.transpose();
    E.row(p) = h.transpose() / reach;
    const Eigen::VectorXd size = E.colwise().norm().transpose().cwiseMax(1e-300);
    const Eigen::VectorXd dual =
        nonnegative_least_squares(E * size.cwiseInverse().asDiagonal(), Eigen::VectorXd::Unit(p + 1, p))
            .cwiseQuotient(size);
    const Eigen::VectorXd rest = E * dual - Eigen::VectorXd::Unit(p + 1, p);
    if (rest.norm() <= 1e3 * kEpsilon * static_cast<double>(p + m)) {
      fit.status = ConstrainedStatus::infeasible;
      for (Eigen::Index i = 0; i < m; ++i) {
        if (dual[i] > 0.0) {
          const auto index = static_cast<std::size_t>(i);
          fit.active.push_back({index, dual[i] / s.length[i], 0.0, 0.0,
                                constraints[index].name + " contradicts the other constraints of this list"});
        }
      }
      return fit;
    }
    for (Eigen::Index i = 0; i < m; ++i) {
      if (dual[i] > 0.0) {
        working.push_back(i);
      }
    }
  }

  const Equality solution(s, s.A(working, Eigen::all), s.b(working));
  const Eigen::VectorXd& x = solution.x;
  fit.estimate = s.column.cwiseProduct(x);
  fit.weighted_rss = (R * x - c).squaredNorm() +
                     std::max(0.0, free.weighted_rss - (R * free.estimate.cwiseQuotient(s.column) - c).squaredNorm());

  Eigen::VectorXd multiplier = Eigen::VectorXd::Zero(m);
  multiplier(working) = solution.multiplier;
  const double data = std::max(s.c.norm(), s.R.norm() * x.norm());
  const double far = std::max({1.0 * x.norm(), m > 0 ? s.b.cwiseAbs().maxCoeff() : 0.0, 1e-300});
  const Eigen::VectorXd gradient = 2.0 * s.R.transpose() * (s.R * x - s.c) + s.A.transpose() * multiplier;
  const Eigen::VectorXd over = s.A * x - s.b;
  const auto raise = [&](double violation) { fit.kkt_residual = std::max(fit.kkt_residual, violation); };
  raise(data > 0.0 ? gradient.norm() / data : 0.0);
  for (Eigen::Index i = 0; i < m; ++i) {
    raise(over[i] / far);
    raise(data > 0.0 ? -multiplier[i] / data : 0.0);
    raise(data > 0.0 ? std::abs(multiplier[i] * over[i]) / (data * far) : 0.0);
    if (multiplier[i] > 0.0 || std::abs(over[i]) <= 16.0 * kEpsilon * far) {
      const auto index = static_cast<std::size_t>(i);
      const LinearConstraint& constraint = constraints[index];
      ActiveConstraint active{index, std::max(0.0, multiplier[i]) / s.length[i], 0.0, 0.0, {}};
      active.excess = constraint.a.dot(free.estimate) - constraint.b;
      if (covariance.size() != 0) {
        const double variance = constraint.a.dot(covariance * constraint.a);
        active.excess_in_errors = variance > 0.0 ? active.excess / std::sqrt(variance) : 0.0;
      }
      active.words = sentence(constraint, active);
      fit.active.push_back(active);
    }
  }
  return fit;
}

}  // namespace wheelwright

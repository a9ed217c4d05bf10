// SPDX-License-Identifier: Apache-2.0
#include "identify/inference/constrained.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <Eigen/Core>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/linear_algebra.hpp"

namespace wheelwright::inference {
namespace {

struct ActiveSet {
  const Eigen::MatrixXd& E;
  const Eigen::VectorXd& f;
  Eigen::VectorXd x;
  std::vector<Eigen::Index> free;  // columns with x > 0

  /// The unconstrained solution in the free columns; empty where they are dependent.
  [[nodiscard]] Eigen::VectorXd solve() const {
    if (free.empty()) {
      return {};
    }
    const core::PivotedQr qr(E(Eigen::all, free));
    return qr.rank() == static_cast<Eigen::Index>(free.size()) ? qr.solve(f) : Eigen::VectorXd();
  }

  /// Moves towards `target` until an entry reaches 0, which leaves the free columns.
  void move(const Eigen::VectorXd& target) {
    double step = 1.0;
    std::size_t blocking = free.size();
    for (std::size_t k = 0; k < free.size(); ++k) {
      const double now = x[free[k]], then = target[static_cast<Eigen::Index>(k)];
      if (then <= 0.0 && now / (now - then) < step) {
        step = now / (now - then);
        blocking = k;
      }
    }
    for (std::size_t k = 0; k < free.size(); ++k) {
      x[free[k]] += step * (target[static_cast<Eigen::Index>(k)] - x[free[k]]);
    }
    for (std::size_t k = free.size(); k-- > 0;) {
      if (k == blocking || !(x[free[k]] > 0.0)) {
        x[free[k]] = 0.0;
        free.erase(free.begin() + static_cast<std::ptrdiff_t>(k));
      }
    }
  }
};

}  // namespace

Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& E, const Eigen::VectorXd& f) {
  check::that(E.rows() == f.size() && E.allFinite() && f.allFinite(), "non-negative least squares",
              "a finite right side with a value for each row of the matrix");
  ActiveSet set{E, f, Eigen::VectorXd::Zero(E.cols()), {}};
  const double tolerance = 64.0 * std::numeric_limits<double>::epsilon() * E.colwise().norm().maxCoeff() * f.norm();
  std::vector<bool> barred(static_cast<std::size_t>(E.cols()), false);
  // Each round ends with a smaller misfit, so that no set of free columns comes back; the limit stops rounding only.
  for (Eigen::Index round = 0; round < 64 * (E.cols() + 1); ++round) {
    const Eigen::VectorXd slope = E.transpose() * (f - E * set.x);
    Eigen::Index best = -1;
    for (Eigen::Index j = 0; j < E.cols(); ++j) {
      if (!(set.x[j] > 0.0) && !barred[static_cast<std::size_t>(j)] && slope[j] > tolerance &&
          (best < 0 || slope[j] > slope[best])) {
        best = j;
      }
    }
    if (best < 0) {
      break;
    }
    set.free.push_back(best);
    Eigen::VectorXd target = set.solve();
    // A column that cannot move forward is a matter of rounding (or depends on the free ones): not again until x moves.
    if (target.size() == 0 || !(target[target.size() - 1] > 0.0)) {
      set.free.pop_back();
      barred[static_cast<std::size_t>(best)] = true;
      continue;
    }
    barred.assign(barred.size(), false);
    while (!set.free.empty() && !(target.array() > 0.0).all()) {
      set.move(target);
      target = set.solve();
    }
    for (std::size_t k = 0; k < set.free.size(); ++k) {
      set.x[set.free[k]] = target[static_cast<Eigen::Index>(k)];
    }
  }
  return set.x;
}

namespace {

/// The problem in scaled columns x = D⁻¹θ and constraints of unit length: min ‖Rx − c‖ subject to Ax <= b.
struct Scaled {
  Eigen::MatrixXd R;
  Eigen::VectorXd c;
  Eigen::VectorXd column;  // θ = column ∘ x
  Eigen::MatrixXd A;
  Eigen::VectorXd b;
  Eigen::VectorXd length;  // of each constraint before it was scaled

  Scaled(const identify::LeastSquares& rows, const std::vector<LinearConstraint>& constraints) {
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
    const Eigen::MatrixXd folded = core::QrFactors(stack).R().topRows(p);
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
      x = core::least_squares_solution(s.R, s.c);
      multiplier.resize(0);
      return;
    }
    const core::QrFactors qr(A.transpose());
    const Eigen::MatrixXd Q = qr.Q();
    const Eigen::MatrixXd U = qr.R();
    const Eigen::VectorXd held = core::solve_lower(U.transpose(), b);
    x = Q.leftCols(m) * held;
    if (m < p) {
      const Eigen::MatrixXd moving = s.R * Q.rightCols(p - m);
      x += Q.rightCols(p - m) * core::least_squares_solution(moving, s.c - s.R * x);
    }
    const Eigen::VectorXd pull = 2.0 * s.R.transpose() * (s.c - s.R * x);
    multiplier = core::solve_upper(U, Q.leftCols(m).transpose() * pull);
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

ConstrainedFit constrained_least_squares(const identify::LeastSquares& rows,
                                         const std::vector<LinearConstraint>& constraints,
                                         const Eigen::MatrixXd& covariance) {
  const identify::LeastSquaresFit free = rows.solve();
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
    const Eigen::MatrixXd G = -core::solve_lower(s.R.transpose(), s.A.transpose()).transpose();  // m × p
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
    if (rest.norm() <= 1e3 * core::kEpsilon * static_cast<double>(p + m)) {
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
    if (multiplier[i] > 0.0 || std::abs(over[i]) <= 16.0 * core::kEpsilon * far) {
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

namespace {

/// "viscous_linear" as people write it.
std::string with_blanks(std::string name) {
  for (char& c : name) {
    c = c == '_' ? ' ' : c;
  }
  return name;
}

/// sign · quantity_j <= bound.
LinearConstraint one_sided(const std::vector<PhysicalQuantity>& parameters, std::size_t j, double sign, double bound) {
  const auto at = static_cast<Eigen::Index>(j);
  LinearConstraint constraint;
  constraint.a = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(parameters.size()));
  constraint.a[at] = sign / parameters[j].per_physical;
  constraint.b = bound;
  return constraint;
}

void check_scales(const std::vector<PhysicalQuantity>& parameters) {
  check::that(!parameters.empty(), "parameters", "at least one");
  for (const PhysicalQuantity& parameter : parameters) {
    check::that(std::isfinite(parameter.per_physical) && parameter.per_physical != 0.0,
                "per_physical of " + parameter.name, "a finite number other than 0");
  }
}

}  // namespace

std::vector<LinearConstraint> physical_consistency(const std::vector<PhysicalQuantity>& parameters,
                                                   std::optional<double> footprint_radius) {
  check_scales(parameters);
  std::vector<LinearConstraint> constraints;
  std::optional<std::size_t> mass, inertia;
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const std::string& name = parameters[j].name;
    if (parameters[j].never_negative) {
      constraints.push_back(one_sided(parameters, j, -1.0, 0.0));
      constraints.back().name = name + " = 0";
      constraints.back().asks = "a negative " + with_blanks(name);
    }
    mass = name == "mass" ? j : mass;
    inertia = name == "yaw_inertia" ? j : inertia;
  }
  if (footprint_radius) {
    const double radius = check::positive(*footprint_radius, "footprint radius");
    if (mass && inertia) {
      LinearConstraint footprint = one_sided(parameters, *inertia, 1.0, 0.0);
      footprint.a[static_cast<Eigen::Index>(*mass)] = -radius * radius / parameters[*mass].per_physical;
      footprint.name = fmt::format("yaw_inertia = mass·R² with R = {} m", radius);
      footprint.asks = "an inertia larger than the footprint allows";
      constraints.push_back(footprint);
    }
  }
  return constraints;
}

}  // namespace wheelwright::inference

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Least squares under linear inequalities, solved exactly: which constraints bind, how hard, and in words.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/identify/least_squares.hpp>

namespace wheelwright {

/// One constraint aᵀθ <= b.
struct LinearConstraint {
  Eigen::VectorXd a;  ///< p, not all zero
  double b = 0.0;
  std::string name;  ///< as an equation where it binds, e.g. "yaw_inertia = mass·R²"
  std::string asks;  ///< what the log asks for where it binds, e.g. "an inertia larger than the footprint allows"
};

/// A constraint that the solution touches.
struct ActiveConstraint {
  std::size_t index = 0;    ///< place in the list that was given
  double multiplier = 0.0;  ///< λ >= 0: the weighted sum of squares falls by λ for each unit by which b grows; 0 where
                            ///< the solution touches the constraint without being held by it
  double excess = 0.0;      ///< aᵀθ_free − b, by how much the fit without constraints violates it
  double excess_in_errors = 0.0;  ///< excess over its standard error; 0 where no covariance was given
  std::string words;              ///< a sentence for people
};

/// How a constrained fit ended.
enum class ConstrainedStatus {
  solved,        ///< `estimate` is the one minimiser
  undetermined,  ///< the rows leave directions free: `estimate` is a minimiser, near the one of least norm in scaled
                 ///< columns
  infeasible,    ///< no θ fulfils the constraints; `estimate` is empty and `active` lists constraints that contradict
                 ///< each other, with multipliers u >= 0 such that Σ u a = 0 and Σ u b < 0 (Farkas)
};

/// The solution of min Σ w² (y − Yθ)² subject to aᵀθ <= b.
struct ConstrainedFit {
  ConstrainedStatus status = ConstrainedStatus::solved;
  Eigen::VectorXd estimate;              ///< p
  Eigen::VectorXd free_estimate;         ///< p, without constraints
  std::vector<ActiveConstraint> active;  ///< in the order of the list that was given
  double weighted_rss = 0.0;             ///< at `estimate`
  double free_rss = 0.0;                 ///< at `free_estimate`
  double kkt_residual = 0.0;  ///< largest violation of the optimality conditions, in columns and constraints of unit
                              ///< length, relative to the size of the data: rounding where all is well
};

/// The exact solution for the rows in `rows`. The problem is a least-distance programme, solved by non-negative least
/// squares (Lawson and Hanson 1974, chapter 23), which ends after finitely many steps; the fit is then solved once more
/// with the active constraints as equations. `covariance` of the free estimate (p × p, or empty) is for the words only.
/// Throws InvalidArgument for a constraint of the wrong size, not finite or without coefficients, or for no rows.
[[nodiscard]] ConstrainedFit constrained_least_squares(const LeastSquares& rows,
                                                       const std::vector<LinearConstraint>& constraints,
                                                       const Eigen::MatrixXd& covariance = {});

}  // namespace wheelwright

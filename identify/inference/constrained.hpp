// SPDX-License-Identifier: Apache-2.0
/// \file
/// Least squares under linear inequalities, solved exactly; non-negative least squares; and physical constraints on
/// θ_L: no negative mass, inertia or friction, and mass inside its footprint.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/interval.hpp"
#include "identify/least_squares.hpp"

namespace wheelwright::inference {

/// argmin ‖Ex − f‖ subject to x >= 0, by Lawson and Hanson's active set (1974, algorithm NNLS 23.10); E has few columns
/// and may have dependent ones. Entries that are not positive are exactly 0, and the columns of positive entries are
/// linearly independent. Columns should be of like size. Throws InvalidArgument where shapes disagree or a number is
/// not finite.
[[nodiscard]] Eigen::VectorXd nonnegative_least_squares(const Eigen::MatrixXd& E, const Eigen::VectorXd& f);

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

/// Status of a constrained fit.
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
[[nodiscard]] ConstrainedFit constrained_least_squares(const identify::LeastSquares& rows,
                                                       const std::vector<LinearConstraint>& constraints,
                                                       const Eigen::MatrixXd& covariance = {});

/// Physical quantity of one entry of θ_L: θ_j = per_physical · quantity (model/model.hpp's Parameter).
struct PhysicalQuantity {
  std::string name;             ///< e.g. "mass", "yaw_inertia", "viscous_linear"
  double per_physical = 1.0;    ///< other than 0
  std::string unit;             ///< of the quantity, for the words, e.g. "kg"
  bool never_negative = false;  ///< >= 0 in every robot
};

/// quantity >= 0 for those that are never negative; and yaw_inertia <= mass·R² where both are there and the radius
/// R > 0, m, of the circle about the wheels' midpoint that holds all of the robot's mass is given: I = ∫ρ² dm with
/// ρ <= R. The closed set is used: a mass of 0 that binds says that the log asks for a negative one. Throws
/// InvalidArgument for a scale of 0 or a radius that is not positive.
[[nodiscard]] std::vector<LinearConstraint> physical_consistency(const std::vector<PhysicalQuantity>& parameters,
                                                                 std::optional<double> footprint_radius = {});

}  // namespace wheelwright::inference

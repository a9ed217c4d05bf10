// SPDX-License-Identifier: Apache-2.0
/// \file
/// Small linear programs max c·x subject to A x <= b with many rows and few variables, solved again and again.
#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

namespace wheelwright {

/// Result of LinearProgram::maximise. Floating point: no bound until it has gone through certificate.hpp.
struct LpSolution {
  /// What the solver found.
  enum class Status {
    optimal,     ///< x, value, rows and multipliers hold
    infeasible,  ///< the solver found no x with A x <= b (unproved)
    failed,      ///< no answer: unbounded, or numerical trouble
  };
  Status status = Status::failed;
  double value = 0.0;           ///< c·x
  Eigen::VectorXd x;            ///< maximiser, a vertex
  std::vector<int> rows;        ///< rows with a multiplier > 0, at most as many as variables
  Eigen::VectorXd multipliers;  ///< λ > 0 of these rows: Aᵀλ ≈ c
};

/// max c·x subject to A x <= b; every solve starts from the basis of the last. Rows should be of norm about one and the
/// feasible set of size about one: tolerances are absolute (1e-10).
///
/// The engine is CLP on the dual program min b·λ, Aᵀλ = c, λ >= 0, whose basis is only variables × variables.
class LinearProgram {
 public:
  /// A program without rows.
  explicit LinearProgram(Eigen::Index variables);
  ~LinearProgram();
  LinearProgram(LinearProgram&&) noexcept;
  LinearProgram& operator=(LinearProgram&&) noexcept;

  /// Adds rows; column k of `a_columns` (variables × k) is row k of A.
  void add_rows(const Eigen::MatrixXd& a_columns, const Eigen::VectorXd& b);
  /// Number of rows.
  [[nodiscard]] Eigen::Index rows() const;
  /// Solves max c·x.
  [[nodiscard]] LpSolution maximise(const Eigen::VectorXd& c);
  /// The row takes no part any more (its number stays).
  void disable(Eigen::Index row);
  /// The row takes part again.
  void enable(Eigen::Index row);

 private:
  struct Engine;
  std::unique_ptr<Engine> engine_;
};

}  // namespace wheelwright

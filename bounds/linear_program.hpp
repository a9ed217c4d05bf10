// SPDX-License-Identifier: Apache-2.0
/// \file
/// Small linear programs max c·x subject to A x <= b with many rows and few variables, solved repeatedly.
#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "bounds/kernels.hpp"

namespace wheelwright::bounds {

/// Result of LinearProgram::maximise. Floating point: no bound until it has gone through certificate.hpp.
struct LpSolution {
  /// What the solver found.
  enum class Status {
    optimal,     ///< x, value, rows and multipliers hold
    infeasible,  ///< the solver found no x with A x <= b (unproved)
    failed,      ///< no answer: the box of the program was reached, or numerical trouble
  };
  Status status = Status::failed;
  double value = 0.0;           ///< c·x
  Eigen::VectorXd x;            ///< maximiser, a vertex
  std::vector<int> rows;        ///< rows with a multiplier > 0, at most as many as variables
  Eigen::VectorXd multipliers;  ///< λ > 0 of these rows: Aᵀλ ≈ c
};

/// max c·x subject to A x <= b, for few variables (tens at most). Rows should be of norm about one and the feasible set
/// of size about one: tolerances are absolute (1e-12).
///
/// A vertex is where p rows meet, the basis; its inverse p × p matrix is held. A dual simplex walk starts where the
/// multipliers are >= 0 (after rows were added), a primal one where the vertex satisfies all rows (after c has turned).
/// The largest violation or the steepest edge is taken; where that stands still, the smallest number (Bland 1977),
/// which does not cycle. The variables have a box of their own that must contain the rows' set in its interior: its
/// corner is where a cold start begins, and an optimum on its sides is reported as `failed`.
class LinearProgram {
 public:
  /// A vertex to start from.
  struct Basis {
    std::vector<int> rows;        ///< numbers of rows, or negative ones for sides of the box; none: no start known
    std::vector<double> inverse;  ///< as the program held it, p × p; none: it is made from `rows`
    std::size_t age = 0;          ///< exchanges since `inverse` was made afresh
  };

  /// A program without rows on lower <= x <= upper, both finite.
  LinearProgram(Eigen::VectorXd lower, Eigen::VectorXd upper);

  /// Adds rows; column k of `a_columns` (variables × k) is row k of A.
  void add_rows(const Eigen::MatrixXd& a_columns, const Eigen::VectorXd& b);
  /// The rows, padded, for the loops of kernels.hpp.
  [[nodiscard]] kernels::Rows view() const;

  /// The largest a·x − b of the rows from `first` on; −infinity where there are none. `x`: as many numbers as
  /// variables.
  [[nodiscard]] double violation(std::size_t first, const double* x) const;

  /// Solves max c·x, starting from the vertex of the last solve.
  [[nodiscard]] LpSolution maximise(const Eigen::VectorXd& c);
  /// Solves max c·x, starting from the basis `start` where it has rows; writes the optimal basis to it. An inverse must
  /// come from this program, or one with the same rows.
  [[nodiscard]] LpSolution maximise(const Eigen::VectorXd& c, Basis& start);

  /// max c·x for a direction of norm one (`c`: as many numbers as variables), starting from the vertex of the last
  /// solve or, where it is better, from one of the vertices that earlier calls ended in; the walk may end as soon as
  /// c·x exceeds `enough`. Nothing where the program fails. Where no vertex is better than those, this costs some p²
  /// products; nothing is allocated but in the first calls.
  [[nodiscard]] std::optional<double> reach(const double* c, double enough);
  /// The vertex of the last solve, p numbers.
  [[nodiscard]] const double* vertex() const { return x_.data(); }

 private:
  enum class Outcome { optimal, infeasible, stuck };

  [[nodiscard]] double coefficient(int row, std::size_t j) const;
  [[nodiscard]] double bound(int row) const;
  void corner(const double* c);
  bool refactor();
  void place();
  void price(const double* c);
  bool renew(const double* c);
  void exchange(std::size_t leaving, int entering, const double* alpha);
  [[nodiscard]] bool priced() const;
  [[nodiscard]] bool accurate(const double* c) const;
  [[nodiscard]] bool inside();
  Outcome dual(const double* c);
  Outcome primal(const double* c);
  Outcome solve(const double* c);
  Outcome solve_cold(const double* c);
  LpSolution report(const Eigen::VectorXd& c, double norm);
  void recall(const double* c);
  void remember();

  std::size_t p_;
  std::vector<double> lower_, upper_;
  std::vector<double> a_, b_;
  std::size_t count_ = 0, stride_ = 0;
  Basis basis_;  // .inverse: column r is the edge along which only row r of the basis is left
  std::vector<double> x_, lambda_, slack_, along_, row_, alpha_, direction_;
  bool factored_ = false;
  bool settled_ = false;      // x_ satisfies all rows
  bool slack_known_ = false;  // slack_ is that of x_
  bool careful_ = false;
  std::vector<Basis> seen_;     // bases of vertices that reach() ended in, which satisfy all rows
  std::vector<double> seen_x_;  // their vertices, by columns
  std::size_t next_seen_ = 0;   // the place of the next one
  double enough_ = std::numeric_limits<double>::infinity();  // for a direction of norm one
};

}  // namespace wheelwright::bounds

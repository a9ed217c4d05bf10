// SPDX-License-Identifier: Apache-2.0
/// \file
/// The linear program behind the consistency test: how much of a deviation no admissible explanation covers.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "bounds/polytope.hpp"
#include "core/regression.hpp"

namespace wheelwright::bench {

/// A disturbance x and what it adds to the rows: |x| <= 1, or |x| <= θ_j where `parameter` names a j with θ_j >= 0.
struct Disturbance {
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::size_t parameter = kNone;
  std::vector<std::pair<std::size_t, double>> entries{};  ///< row, weight
};

/// The question min σ over θ, θ° in P and disturbances x, with θ̂ the centre of P:
///
///     Y(θ − θ̂) − A(θ° − θ̂) + Dx = (1 − σ) ζ
///
/// σ = 1 is always feasible. σ > 0 at the optimum: ζ has no explanation, whose dual λ is a residual λᵀ(…) that
/// separates it from everything admissible, normalised to λᵀζ = 1.
struct SeparationProblem {
  const Polytope* set = nullptr;
  const core::RowMatrix* healthy = nullptr;  ///< Y, rows × p
  const core::RowMatrix* faulty = nullptr;   ///< A, or none
  std::vector<Disturbance> disturbances{};   ///< D
  Eigen::VectorXd deviation{};               ///< ζ
  bool fixed = false;                        ///< θ is `member` rather than all of P
  Eigen::VectorXd member{};                  ///< p
};

/// Its answer, to the solver's tolerance; what is to be a proof must be evaluated from `weights`.
struct Separation {
  bool solved = false;
  double share = 0.0;       ///< σ, at least −1
  Eigen::VectorXd weights;  ///< λ
  Eigen::VectorXd theta;    ///< θ, p
  Eigen::VectorXd faulty;   ///< θ°, p; θ̂ where there is no A
};

/// Solves such programs one after the other; each starts at the basis in which the last one of its size ended.
class SeparationSolver {
 public:
  [[nodiscard]] Separation solve(const SeparationProblem& problem);
  /// How many programs were solved.
  [[nodiscard]] std::size_t programs() const { return programs_; }

 private:
  std::vector<unsigned char> basis_;
  std::size_t programs_ = 0;
};

}  // namespace wheelwright::bench

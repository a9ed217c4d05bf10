// SPDX-License-Identifier: Apache-2.0
/// \file
/// Robust regression: losses and their minimum over rows in memory (by Ceres), and an estimate that a few wrong rows
/// (glitches of an effort sensor, bumps, slip) cannot carry away.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/regression.hpp"
#include "identify/inference/constrained.hpp"

namespace wheelwright::inference {

/// A loss ρ(u), even, with ρ(u) ≈ u²/2 near 0 (Huber 1981; Maronna, Martin and Yohai 2006, chapter 2).
enum class Loss {
  squared,  ///< u²/2: least squares
  huber,    ///< u²/2 up to |u| = c, then c|u| − c²/2: convex, the influence of a row is bounded
  cauchy,   ///< c²/2·ln(1 + u²/c²): the influence of a row falls as 1/|u|; not convex
  tukey,    ///< c²/6·(1 − (1 − u²/c²)³), and c²/6 beyond |u| = c: rows beyond c count nothing; not convex
};

/// The constant c with which a location or regression estimate keeps 95 % of the efficiency of least squares under
/// Gaussian residuals: 1.345 (huber), 2.385 (cauchy), 4.685 (tukey; Holland and Welsch 1977). 1 for squared, which has
/// none.
[[nodiscard]] double tuning_constant(Loss loss);

/// A loss with its constant c > 0.
struct LossFunction {
  Loss loss = Loss::huber;
  double c = 1.345;

  /// ρ(u) >= 0.
  [[nodiscard]] double rho(double u) const;
  /// ψ = ρ'.
  [[nodiscard]] double psi(double u) const;
  /// ψ', the limit from the side of 0 where it jumps.
  [[nodiscard]] double psi_slope(double u) const;
  /// ψ(u)/u in [0, 1], 1 at u = 0: the weight of the row in an equivalent least-squares fit.
  [[nodiscard]] double weight(double u) const;
  /// |u| beyond which the weight is below 1/2; infinite for squared.
  [[nodiscard]] double half_weight() const;
  /// sgn(u)·√(2ρ(u)), free of cancellation, and its derivative: least squares on it is the robust fit.
  struct Root {
    double value = 0.0;
    double slope = 1.0;
  };
  [[nodiscard]] Root root(double u) const;
};

/// Where Ceres stopped.
struct MEstimate {
  Eigen::VectorXd theta;   ///< p
  bool converged = false;  ///< Ceres's gradient, step or cost tolerance was met
  std::string message;     ///< Ceres's words
};

/// A local minimum of Σ ρ((y − Yθ)/s) near `start`, s one scale > 0 for each output, in at most 200 iterations of
/// Levenberg and Marquardt's method on the roots of the losses (LossFunction::root), in coordinates in which the rows
/// are orthonormal. Directions that the rows do not determine stay as they are in `start`.
[[nodiscard]] MEstimate m_estimate(const RegressionBlock& rows, const Eigen::VectorXd& scales, const LossFunction& loss,
                                   const Eigen::VectorXd& start);

/// Invertible B such that every constraint bounds one entry of z = Bθ: lower <= z <= upper, entries infinite where
/// nothing bounds them.
struct BoxCoordinates {
  Eigen::MatrixXd B;
  Eigen::VectorXd lower, upper;
};

/// True if `constraints` on p unknowns are a box in other coordinates: `box` is filled where they are (rows parallel to
/// each other apart, they are independent, and every interval has an inside).
[[nodiscard]] bool find_box(const std::vector<LinearConstraint>& constraints, Eigen::Index p, BoxCoordinates& box);

/// The same with the bounds of `box`; `start` is moved into them.
[[nodiscard]] MEstimate m_estimate(const RegressionBlock& rows, const Eigen::VectorXd& scales, const LossFunction& loss,
                                   const Eigen::VectorXd& start, const BoxCoordinates& box);

/// Choices of a robust fit.
struct RobustOptions {
  Loss loss = Loss::huber;
  double tuning = 0.0;                          ///< c of the loss; 0: the one of 95 % efficiency
  std::vector<LinearConstraint> constraints{};  ///< aᵀθ <= b; empty: none
  std::size_t most_instants = 100000;  ///< instants held in memory, at least 8; of a longer log every 2nd, 4th, 8th …
                                       ///< is held, and the fit to those is finished by passes over all of them
  std::size_t most_passes = 50;        ///< reweighted passes at the end
  std::size_t most_episodes = 10;      ///< length of RobustFit::episodes
};

/// Status of a robust fit.
enum class RobustStatus {
  converged,      ///< the last reweighted fit moved the estimate by less than 10⁻⁶ of a standard error (of white
                  ///< residuals)
  not_converged,  ///< the passes were spent before; `last_step` says how far the last one went
  infeasible,     ///< the constraints contradict each other (constrained.hpp); there is no estimate
};

/// Weights of the rows of one output.
struct OutputWeights {
  double scale = 0.0;  ///< s: median |y − Yθ|/0.6745 at the fit of nearly least absolute values, the standard
                       ///< deviation of Gaussian residuals; unit of the output
  double down_weighted = 0.0;   ///< share of instants with a weight ψ(u)/u below 1/2
  double gaussian_share = 0.0;  ///< that share if residuals were Gaussian
  double rejected = 0.0;        ///< share of instants with weight 0 (tukey)
};

/// Consecutive instants in which an output has a weight below 1/2.
struct Episode {
  std::size_t output = 0;
  double first_time = 0.0;  ///< s
  double last_time = 0.0;   ///< s
  std::size_t instants = 0;
  std::size_t worst_sample = 0;  ///< row of the log where |u| is largest
  double worst_time = 0.0;       ///< its time, s
  double worst = 0.0;            ///< u = residual/scale there
};

/// Result of a robust fit.
struct RobustFit {
  RobustStatus status = RobustStatus::converged;
  Eigen::VectorXd estimate;        ///< p
  Eigen::MatrixXd covariance;      ///< p × p, under autocorrelated residuals; on the face of the active constraints,
                                   ///< so that it is 0 across them
  Eigen::VectorXd standard_error;  ///< p, roots of its diagonal
  double freedom = 0.0;            ///< degrees of freedom of its Student's t
  std::vector<OutputWeights> outputs;
  std::vector<Episode> episodes;         ///< the worst ones, largest |u| first
  std::vector<ActiveConstraint> active;  ///< multipliers in units of 2Σρ
  double objective = 0.0;                ///< Σ ρ(r/s) over all rows
  double last_step = 0.0;                ///< of the last pass, in standard errors of white residuals
  int rank = 0;                          ///< of the reweighted columns
  std::size_t passes = 0;                ///< reweighted passes at the end
  std::size_t instants = 0;              ///< instants of the log
  std::size_t held = 0;                  ///< of them held in memory
  bool solver_converged = true;          ///< what Ceres said of the rows in memory
  bool exact_fit = false;                ///< an output's median residual is rounding: its scale is 10⁻¹² of the rms
                                         ///< of y
};

/// Minimises Σ ρ((y − Yθ)/s) over all instants and outputs, one loss for each.
///
/// 1. Start: least squares, then in turn median scales and a reweighted fit with Huber's loss at c = 0.05, nearly that
///    of least absolute values, until the scales move by less than 10⁻⁴ (which leaves them within half a per cent of
///    where they go). They are kept from there on. (Scales found together with Huber's estimate at c = 1.345 grow with
///    the errors: three tenths of the rows wrong to one side would carry both away.)
/// 2. Ceres solves Huber's problem, which is convex, on the rows in memory; cauchy and tukey are not convex: they start
///    from Huber's solution and end in the minimum next to it. Constraints that are bounds after a change of
///    variables (rows of A independent up to their sign) are given to Ceres; where they are not, step 3 does it all.
/// 3. Reweighted least squares, each step solved exactly under the constraints, over all rows: descent in Σρ (Huber
///    1981, section 7.8), until it stands. Where all rows are in memory this confirms Ceres in a few steps; a longer
///    log is walked once for each step.
///
/// Memory: p + 1 numbers for each row held, twice, and p for each in Ceres's Jacobian: 25 MB for 10⁵ instants of two
/// outputs at p = 5. Thinning is by the number of the instant, so that the same log gives the same fit; neighbours of a
/// filtered log say nearly the same.
///
/// Covariance: H⁻¹ Ω H⁻¹ with H = Σ ψ'(u) YᵀY/s² and Ω the long-run covariance of the scores Σ ψ(u) Yᵀ/s
/// (block_sums.hpp); it takes the scales as known, which is right to first order where residuals are symmetric.
///
/// It guards against wrong values of y. A row whose *regressor* is grossly wrong pulls with all its leverage on the
/// start: no method that starts from least squares withstands many of them.
///
/// Throws InvalidArgument for options outside their ranges and for a source without instants.
[[nodiscard]] RobustFit robust_fit(core::RegressionSource& rows, const RobustOptions& options = {});

}  // namespace wheelwright::inference

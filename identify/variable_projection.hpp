// SPDX-License-Identifier: Apache-2.0
/// \file
/// Separable least squares by variable projection: a few shape parameters ω enter nonlinearly, all others linearly.
#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace wheelwright::identify {

/// A separable model at one ω: what stands in y ≈ f(ω) + Φ(ω)θ.
struct SeparableValues {
  Eigen::VectorXd offset;                   ///< N, f(ω); empty: zero
  Eigen::MatrixXd columns;                  ///< N × p, Φ(ω)
  std::vector<Eigen::VectorXd> offset_by;   ///< for each ω_k: N, ∂f/∂ω_k; empty where the offset is
  std::vector<Eigen::MatrixXd> columns_by;  ///< for each ω_k: N × p, ∂Φ/∂ω_k
};

/// A model y ≈ f(ω) + Φ(ω)θ with q shape parameters ω and p linear parameters θ. p may be 0 (an ordinary nonlinear
/// model); q is at least 1.
class SeparableModel {
 public:
  virtual ~SeparableModel() = default;
  /// N, the left side y: instants × outputs, instant-major.
  [[nodiscard]] virtual const Eigen::VectorXd& response() const = 0;
  /// Outputs of one instant; N is a multiple of it.
  [[nodiscard]] virtual std::size_t outputs() const { return 1; }
  /// q >= 1.
  [[nodiscard]] virtual Eigen::Index shapes() const = 0;
  /// p >= 0.
  [[nodiscard]] virtual Eigen::Index columns() const = 0;
  /// Fills `at` at `shape` (q), with derivatives where they are asked for. Returns false where the model is not defined
  /// there; values that are not finite are taken alike.
  virtual bool evaluate(const Eigen::VectorXd& shape, bool derivatives, SeparableValues& at) const = 0;
};

/// Search range and stopping rules.
struct VariableProjectionOptions {
  Eigen::VectorXd start;      ///< q; empty: the best of a grid of `scan` values of each shape (needs finite bounds)
  Eigen::VectorXd lower;      ///< q, empty: none
  Eigen::VectorXd upper;      ///< q, empty: none
  Eigen::VectorXd weights;    ///< w_i > 0 for each output, empty: all one
  int scan = 13;              ///< >= 2, values of each shape on the grid
  int most_iterations = 500;  ///< > 0
  /// Relative change of the cost (> 0) below which the search ends. Steps on the gradient alone follow, which find the
  /// remaining digits where the cost is like a parabola by then; in a long narrow valley it is not.
  double flat = std::numeric_limits<double>::epsilon();
  double rank_tolerance = 1e-13;  ///< diagonal of the pivoted triangular factor of unit columns below which a column
                                  ///< counts as linearly dependent on the others
  bool full_jacobian = true;      ///< Golub and Pereyra 1973; false: without its second term (Kaufman 1975)
};

/// Status of the search.
enum class SearchEnd {
  converged,   ///< no step lowers the cost any more
  iterations,  ///< most_iterations were used up: the numbers are the best seen
  failed,      ///< the model is not defined at the start, or no step could be made
};

/// Knowledge of one shape parameter.
enum class ShapeState {
  identified,
  at_lower,  ///< at its lower bound with the cost falling beyond: its covariance is that of a fixed number, 0
  at_upper,  ///< at its upper bound, likewise
  flat,      ///< the data do not tell it: its column depends linearly on the others, or its 95 % interval is wider than
  ///< the bounds (without bounds: than a million times the estimate). The estimate is one of many; no interval
  ///< is given (standard error infinite)
};

/// Solution of min over lower <= ω <= upper and θ of Σ w_i² (y − f(ω) − Φ(ω)θ)².
struct SeparableFit {
  SearchEnd end = SearchEnd::failed;
  std::vector<ShapeState> state;  ///< q
  Eigen::VectorXd shape;          ///< q, ω̂
  Eigen::VectorXd linear;         ///< p, θ̂
  int rank = 0;                   ///< numerical rank of Φ(ω̂); below p the columns left over have θ_j = 0
  double weighted_rss = 0.0;      ///< the minimum
  int iterations = 0;
  Eigen::VectorXd standard_error;             ///< q + p, ω first: valid under autocorrelated residuals
  double freedom = 0.0;                       ///< degrees of freedom of its Student's t
  Eigen::MatrixXd covariance;                 ///< (q+p) × (q+p), the sandwich; rows of fixed or flat parameters 0
  Eigen::MatrixXd covariance_if_independent;  ///< the same if residuals were independent and alike: s²(JᵀJ)⁻¹ with
                                              ///< s² = rss/(N − p − q)
};

/// Separable least squares. θ is eliminated: the outer problem is min ||P⊥(ω)(y − f(ω))|| over ω alone, with the
/// Jacobian of Golub and Pereyra (1973) or Kaufman (1975), by a trust-region method with bounds (Ceres), and a few
/// Gauss-Newton steps on the gradient at the end. Against a search over (ω, θ) together it needs no start for θ and is
/// better conditioned (Golub and Pereyra 2003).
///
/// The covariance is G⁻¹ΩG⁻¹ with G = JᵀJ of the joint Jacobian J = [∂(f + Φθ)/∂ω, Φ] and Ω the long-run covariance of
/// the scores Jᵀr instant by instant (moments.hpp). Throws InvalidArgument on shapes that disagree, bounds that
/// cross, a start outside them, weights that are not positive, or no start and no finite bounds.
[[nodiscard]] SeparableFit variable_projection(const SeparableModel& model, const VariableProjectionOptions& options);

/// One point of a cost curve.
struct CostPoint {
  double shape = 0.0;
  double weighted_rss = std::numeric_limits<double>::quiet_NaN();  ///< NaN where the model is not defined
};

/// The cost, minimised over θ, along shape parameter `which` from `lower` to `upper` in `points` >= 2 equal steps, the
/// other shapes as in `shape`: for a plot. Throws InvalidArgument on arguments outside these ranges.
[[nodiscard]] std::vector<CostPoint> cost_curve(const SeparableModel& model, const Eigen::VectorXd& shape,
                                                std::size_t which, double lower, double upper, std::size_t points,
                                                const Eigen::VectorXd& weights = {});

}  // namespace wheelwright::identify

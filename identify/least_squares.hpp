// SPDX-License-Identifier: Apache-2.0
/// \file
/// Least squares on filtered torque by sequential QR: θ̂_L of (30) without ever holding the rows; its residuals, its
/// excitation.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/regression.hpp"
#include "identify/moments.hpp"

namespace wheelwright::identify {

/// Solution of min Σ w_i² (y − Yθ)².
struct LeastSquaresFit {
  Eigen::VectorXd estimate;      ///< p; along directions that the data do not determine, the part of least norm in
                                 ///< scaled columns
  Eigen::VectorXd column_rms;    ///< p, root mean square of each weighted column (per instant)
  Eigen::VectorXd partial_rms;   ///< p, the same after the part that the other columns explain is taken away: what
                                 ///< the data say about θ_j alone
  Eigen::MatrixXd inverse_gram;  ///< p × p, (Σ w² YᵀY)⁻¹ (pseudo-inverse where the rank is deficient)
  int rank = 0;                  ///< numerical rank with columns scaled to unit length
  double condition = 0.0;        ///< ratio of the largest to the smallest singular value of the scaled columns
  double weighted_rss = 0.0;     ///< Σ w_i² (y − Yθ̂)²
  double weighted_tss = 0.0;     ///< Σ w_i² y²
  std::size_t instants = 0;      ///< number of instants
};

/// Ordinary least squares, or weighted with one weight for each output. Rows are folded into a (p+1) × (p+1)
/// triangular factor by Householder reflections (Golub and Van Loan 2013, section 5.2), so that the condition number
/// enters once, not squared.
class LeastSquares {
 public:
  /// `weights`: w_i > 0 for each output; one over its residual's standard deviation is efficient. Empty: all one.
  explicit LeastSquares(std::size_t parameters, Eigen::VectorXd weights = {});
  /// Adds instants [first, last) of `block` (all by default).
  void add(const RegressionBlock& block, std::size_t first = 0, std::size_t last = static_cast<std::size_t>(-1));
  /// Number of instants added.
  [[nodiscard]] std::size_t instants() const { return instants_; }
  /// The triangular factor of [Y y] with weighted rows: (p+1) × (p+1), upper triangular; ‖[Y y]v‖ = ‖factor()·v‖ for
  /// every v.
  [[nodiscard]] Eigen::MatrixXd factor() const;
  /// The fit to what was added, with θ_j = 0 where `excluded[j]` (empty: none). Throws InvalidArgument when nothing was
  /// added.
  [[nodiscard]] LeastSquaresFit solve(const std::vector<bool>& excluded = {}) const;

 private:
  void fold() const;

  std::size_t p_;
  Eigen::VectorXd weights_;
  std::size_t instants_ = 0;
  mutable Eigen::MatrixXd stack_;  // triangular factor on top, rows waiting to be folded below
  mutable Eigen::Index filled_;
};

/// The fit to all of `rows`, one pass.
[[nodiscard]] LeastSquaresFit least_squares(core::RegressionSource& rows, const Eigen::VectorXd& weights = {});

/// Residuals of one output.
struct OutputResidual {
  double rms = 0.0;                 ///< root mean square of ε = y − Yθ̂
  double torque_rms = 0.0;          ///< root mean square of y
  double largest = 0.0;             ///< max |ε|
  std::size_t largest_sample = 0;   ///< row of the log where it is
  double largest_time = 0.0;        ///< its time, s
  double kurtosis = 0.0;            ///< E ε⁴/(E ε²)²; 3 for Gaussian noise
  double effective_instants = 0.0;  ///< number of independent Gaussian values that would know the variance as well
  double fit_freedom = 0.0;  ///< degrees of freedom with which the errors of its parameters are known from residuals
                             ///< where they are seen: the least over them (effective_freedom())
};

/// Residual statistics of a fit over a log.
struct ResidualSummary {
  std::vector<OutputResidual> outputs;  ///< one for each output
  Eigen::MatrixXd covariance;           ///< p × p, of θ̂, under autocorrelated residuals
  Eigen::VectorXd standard_error;       ///< p, roots of its diagonal
  double freedom = 0.0;                 ///< degrees of freedom of its Student's t
  /// p × p, of the least-squares θ̂ if residuals were everywhere as large and as slow as they are on the whole log:
  /// told from all of it, where `covariance` tells a column that is seen once from what is left of the noise there.
  Eigen::MatrixXd stationary_covariance;
  std::size_t instants = 0;
};

/// Gathers residual statistics in one pass over the rows, in bounded memory.
class ResidualStatistics {
 public:
  /// For residuals at `theta` (p) with the weights (one for each output) of the fit.
  ResidualStatistics(Eigen::VectorXd theta, Eigen::VectorXd weights);
  /// Adds instants [first, last) of `block`.
  void add(const RegressionBlock& block, std::size_t first = 0, std::size_t last = static_cast<std::size_t>(-1));
  /// The summary; `inverse_gram` is that of the fit. The covariance is the sandwich G⁻¹ Ω G⁻¹ with Ω the long-run
  /// covariance of the scores w²Yᵀε (moments.hpp); the stationary one has Ω = Σ w⁴ S YᵀY over the outputs, with S the
  /// long-run variance of ε at an instant.
  [[nodiscard]] ResidualSummary summary(const Eigen::MatrixXd& inverse_gram) const;

 private:
  void know_errors(ResidualSummary& s, const Eigen::MatrixXd& inverse_gram) const;

  Eigen::VectorXd theta_, weights_;
  std::vector<OutputResidual> outputs_;
  std::vector<double> squares_, fourth_, torque_squares_;
  std::size_t instants_ = 0;
  BlockSums scores_;   // p
  BlockSums squared_;  // one for each output: ε²
  BlockSums errors_;   // one for each output: ε
  BlockSums grams_;    // p × p for each output: YᵀY
};

/// Excitation of one parameter by a log.
enum class Excitation {
  identified,   ///< the estimate can be used
  indistinct,   ///< excited, but not told from zero at 95 %: the estimate is small, its interval holds zero
  not_excited,  ///< the log says nothing about it: no number is given
};

/// The finding for one parameter.
struct ExcitationFinding {
  Excitation state = Excitation::identified;
  double signal_rms = 0.0;  ///< what the parameter's column holds beyond the other columns (weighted units)
  double noise_rms = 0.0;   ///< what sensor noise alone would put there (0: unknown)
  std::string reason;       ///< one sentence for people, empty when identified
};

/// A column holds motion from this multiple on of the root mean square of what noise alone would put there.
inline constexpr double signal_over_noise = 3.0;

/// Makes `finding` that of a parameter whose column is no more than noise.
void judge_noise_alone(ExcitationFinding& finding);

/// Judges each parameter. `noise_rms` (p, or empty): root mean square of sensor noise in each weighted column;
/// `standard_error` (p) and its t quantile for 95 %.
///
/// not_excited: the column is nothing beyond the other columns (numerical rank), or holds less than three times what
/// noise alone would put there. Least squares would still give a number with a small standard error: that number would
/// be made of noise.
[[nodiscard]] std::vector<ExcitationFinding> judge_excitation(const LeastSquaresFit& fit,
                                                              const Eigen::VectorXd& standard_error, double t_quantile,
                                                              const Eigen::VectorXd& noise_rms = {});

}  // namespace wheelwright::identify

namespace wheelwright {
using identify::least_squares;
}  // namespace wheelwright

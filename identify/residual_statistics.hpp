// SPDX-License-Identifier: Apache-2.0
/// \file
/// What the residuals of a fit say: their size in each output, how many of them are independent, and how far θ̂ may be off.
#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/core/regression.hpp>
#include <wheelwright/identify/block_sums.hpp>
#include <wheelwright/identify/least_squares.hpp>

namespace wheelwright {

/// Residuals of one output.
struct OutputResidual {
  double rms = 0.0;                 ///< root mean square of ε = y − Yθ̂
  double torque_rms = 0.0;          ///< root mean square of y
  double largest = 0.0;             ///< max |ε|
  std::size_t largest_sample = 0;   ///< row of the log where it is
  double largest_time = 0.0;        ///< its time, s
  double kurtosis = 0.0;            ///< E ε⁴/(E ε²)²; 3 for Gaussian noise
  double effective_instants = 0.0;  ///< number of independent Gaussian values that would know the variance as well
};

/// Residual statistics of a fit over a log.
struct ResidualSummary {
  std::vector<OutputResidual> outputs;  ///< one for each output
  Eigen::MatrixXd covariance;           ///< p × p, of θ̂, under autocorrelated residuals
  Eigen::VectorXd standard_error;       ///< p, roots of its diagonal
  double freedom = 0.0;                 ///< degrees of freedom of its Student's t
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
  /// covariance of the scores w²Yᵀε (block_sums.hpp).
  [[nodiscard]] ResidualSummary summary(const Eigen::MatrixXd& inverse_gram) const;

 private:
  Eigen::VectorXd theta_, weights_;
  std::vector<OutputResidual> outputs_;
  std::vector<double> squares_, fourth_, torque_squares_;
  std::size_t instants_ = 0;
  BlockSums scores_;   // p
  BlockSums squared_;  // one for each output: ε²
};

}  // namespace wheelwright

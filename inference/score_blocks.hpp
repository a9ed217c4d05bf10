// SPDX-License-Identifier: Apache-2.0
/// \file
/// The estimating equations of a regression block by block, Σ_b (c_b − A_b θ) = 0: what is resampled and perturbed.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/identify/estimate.hpp>
#include <wheelwright/identify/moments.hpp>

namespace wheelwright {

/// The equations of least squares (A = Σ w²YᵀY, c = Σ w²Yᵀy) or of instrumental variables (Σ w²ZᵀY, Σ w²Zᵀy) over
/// blocks of time, for q kept parameters, with columns and rows scaled to unit length over the log. With ψ = θ·scale:
/// score of block b at θ: c_b − A_b ψ.
struct ScoreBlocks {
  std::size_t parameters = 0;      ///< p, of the moments
  std::vector<Eigen::Index> kept;  ///< q indices of the parameters that are estimated
  Eigen::VectorXd scale;           ///< q, length of each kept column of Y
  Eigen::MatrixXd A;               ///< q² × B, the columns of A_b one below the other
  Eigen::MatrixXd c;               ///< q × B
  Eigen::MatrixXd total_A;         ///< q × q
  Eigen::VectorXd total_c;         ///< q
  Eigen::MatrixXd shape;           ///< q × q, Σ w²ZᵀZ (Σ w²YᵀY without instruments), scaled as the rows of A
  Eigen::VectorXd psi;             ///< q, the solution, scaled
  Eigen::MatrixXd inverse;         ///< q × q, total_A⁻¹
  double block_seconds = 0.0;      ///< typical length of a block, s
  bool solvable = false;           ///< whether the equations have one solution; if not, `reason` says why
  std::string reason;              ///< empty where solvable

  /// B.
  [[nodiscard]] std::size_t blocks() const { return static_cast<std::size_t>(c.cols()); }
  /// Number of neighbouring blocks that last `seconds` or a little more; at least 1 and at most B.
  [[nodiscard]] std::size_t lasting(double seconds) const;
  /// Scores at ψ, q × B.
  [[nodiscard]] Eigen::MatrixXd scores(const Eigen::VectorXd& at) const;
  /// p values of θ from q of ψ; `other` for parameters that were left out.
  [[nodiscard]] Eigen::VectorXd unscaled(const Eigen::VectorXd& at, double other = 0.0) const;
};

/// The blocks of `moments`; with `instruments`, where the moments have them, the equations of instrumental variables.
[[nodiscard]] ScoreBlocks score_blocks(const RegressionMoments& moments, const EstimatorOptions& options,
                                       bool instruments);

/// The same equations over groups of `length` >= 1 neighbouring blocks; the last group may be shorter.
[[nodiscard]] ScoreBlocks grouped(const ScoreBlocks& blocks, std::size_t length);

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Block bootstrap of θ: block lengths, the estimating equations block by block, intervals by resampling.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "identify/estimate.hpp"
#include "identify/moments.hpp"

namespace wheelwright::inference {

/// Spectrum at zero of a mean-zero series with autocovariances R(k), by a flat-top window (Politis and Romano 1995).
struct SeriesMemory {
  double variance = 0.0;  ///< R(0)
  double long_run = 0.0;  ///< Σ_k λ(k/M) R(k), at least a hundredth of R(0)
  double weighted = 0.0;  ///< Σ_k λ(k/M) |k| R(k)
  std::size_t lags = 0;   ///< M, twice the lag after which autocorrelations are insignificant
};

/// The memory of `series`, whose mean is taken away. M by the rule of Politis and White (2004): twice the smallest lag
/// m after which max(5, √log10 N) autocorrelations in a row are below 2·√(log10 N / N).
[[nodiscard]] SeriesMemory series_memory(const Eigen::VectorXd& series);

/// Length of the blocks of a circular block bootstrap (Politis and White 2004, corrected by Patton, Politis and White
/// 2009): (1.5·G²/g²·N)^{1/3} with g, G the long-run and the weighted sum of `series_memory`; the largest over the rows
/// of `series` (components × N), in values, at least 1 and at most min(3√N, N/3).
[[nodiscard]] std::size_t bootstrap_block_length(const Eigen::MatrixXd& series);

/// Share of the variance of a sum that is lost when blocks of `length` values are taken to be independent,
/// G/(g·length); the largest over the rows of `series` (components × N).
[[nodiscard]] double edge_share(const Eigen::MatrixXd& series, std::size_t length);

/// The smallest length whose `edge_share` is at most `lost`, but at most N/`groups`: for groups of a sum that get one
/// random sign each.
[[nodiscard]] std::size_t sign_group_length(const Eigen::MatrixXd& series, double lost, std::size_t groups);

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
[[nodiscard]] ScoreBlocks score_blocks(const identify::RegressionMoments& moments,
                                       const identify::EstimatorOptions& options, bool instruments);

/// The same equations over groups of `length` >= 1 neighbouring blocks; the last group may be shorter.
[[nodiscard]] ScoreBlocks grouped(const ScoreBlocks& blocks, std::size_t length);

/// Options of the resampling.
struct BlockBootstrapOptions {
  identify::EstimatorOptions estimator;
  bool instruments = true;       ///< use the instruments where the moments have them
  double confidence = 0.95;      ///< of each interval
  std::size_t resamples = 1000;  ///< at least 20
  double seconds = 0.0;  ///< length of a stretch, s; 0: by Politis and White (block_bootstrap.hpp) on the influence
  std::uint64_t seed = 1;
};

/// Result of the resamples. Parameters that were left out are zero everywhere.
struct BlockBootstrap {
  bool usable = false;             ///< whether the equations could be solved; if not, `reason` says why
  std::string reason;              ///< empty where usable
  Eigen::VectorXd theta;           ///< p, θ̂
  Eigen::VectorXd standard_error;  ///< p, of θ̂, from overlapping stretches and what their edges miss (edge_share)
  Eigen::VectorXd lower, upper;  ///< p, θ̂ ∓ t*·standard_error, t* the quantile of |θ* − θ̂| over its own error
  Eigen::VectorXd percentile_lower;  ///< p, quantile of θ*
  Eigen::VectorXd percentile_upper;  ///< p
  double confidence = 0.0;
  double seconds = 0.0;       ///< length of a stretch, s
  std::size_t stretches = 0;  ///< in a resample
  std::size_t resamples = 0;  ///< that were used
  std::size_t singular = 0;   ///< that could not be solved and were left out
  std::uint64_t seed = 0;
};

/// Circular block bootstrap (Politis and Romano 1992) of least squares or instrumental variables: stretches of
/// neighbouring blocks, drawn at random with replacement, are added up to a log as long as the real one and solved
/// for θ*. Intervals are symmetric percentile-t ones (Hall 1988), each θ* divided by the standard error that its own
/// stretches show (Götze and Künsch 1996). The same result for the same seed. The blocks are what moments keep: at most
/// 2048 and at least 4 instants long.
///
/// Promise: the confidence as the log grows, for stationary errors of short memory; no symmetry is needed.
[[nodiscard]] BlockBootstrap block_bootstrap(const identify::RegressionMoments& moments,
                                             const BlockBootstrapOptions& options = {});

}  // namespace wheelwright::inference

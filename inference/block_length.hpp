// SPDX-License-Identifier: Apache-2.0
/// \file
/// How long blocks of time must be for a series: for a bootstrap over blocks, and for signs per block.
#pragma once

#include <cstddef>

#include <Eigen/Core>

namespace wheelwright {

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

}  // namespace wheelwright

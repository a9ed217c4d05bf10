// SPDX-License-Identifier: Apache-2.0
/// \file
/// Intervals for θ by resampling stretches of the log: a circular block bootstrap on the moments.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include <Eigen/Core>

#include <wheelwright/identify/estimate.hpp>
#include <wheelwright/identify/moments.hpp>

namespace wheelwright {

/// How it is resampled.
struct BlockBootstrapOptions {
  EstimatorOptions estimator;
  bool instruments = true;       ///< use the instruments where the moments have them
  double confidence = 0.95;      ///< of each interval
  std::size_t resamples = 1000;  ///< at least 20
  double seconds = 0.0;  ///< length of a stretch, s; 0: by Politis and White (block_length.hpp) on the influence
  std::uint64_t seed = 1;
};

/// What the resamples say. Parameters that were left out are zero everywhere.
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
[[nodiscard]] BlockBootstrap block_bootstrap(const RegressionMoments& moments,
                                             const BlockBootstrapOptions& options = {});

}  // namespace wheelwright

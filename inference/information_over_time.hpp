// SPDX-License-Identifier: Apache-2.0
/// \file
/// Which seconds of a log carry the information about each parameter.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include <wheelwright/identify/moments.hpp>

namespace wheelwright {

/// How the log is cut.
struct InformationOptions {
  Eigen::VectorXd weights;  ///< one for each output; empty: all one
  double seconds = 0.0;     ///< length of a window, s; 0: a sixtieth of the log
  double coverage = 0.8;    ///< share that the shortest set of windows is to carry, in (0, 1]
};

/// Information about one parameter.
struct ParameterInformation {
  double information = 0.0;           ///< 1/[(Σ w²YᵀY)⁻¹]_jj; 0 where the log does not tell θ_j from the others
  Eigen::VectorXd share;              ///< of each window, sum 1; all zero without information
  Eigen::VectorXd cumulative;         ///< share up to the end of each window
  std::vector<std::size_t> shortest;  ///< fewest windows that carry `coverage`, in the order of time
  std::vector<std::pair<double, double>>
      spans;             ///< the same as stretches [first, last] of the log, s, neighbours joined
  double seconds = 0.0;  ///< their length together
};

/// Information over time.
struct InformationOverTime {
  std::vector<MomentBlock> windows;
  std::vector<ParameterInformation> parameters;  ///< p
};

/// Partial information about θ_j is what its column holds beyond the other columns over the whole log, I_j = min over d
/// with d_j = 1 of dᵀ(Σ w²YᵀY)d: the inverse of θ̂_j's variance under white errors. With its minimising d the share of
/// window k is dᵀ(Σ_{in k} w²YᵀY)d / I_j: at least zero, and all of them add up to one. Windows are made of whole
/// blocks of the moments.
[[nodiscard]] InformationOverTime information_over_time(const RegressionMoments& moments,
                                                        const InformationOptions& options = {});

}  // namespace wheelwright

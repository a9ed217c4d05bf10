// SPDX-License-Identifier: Apache-2.0
/// \file
/// Elementary effects (morris1991): which of many inputs matter at all, for few evaluations.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace wheelwright {

/// Options of a screening, which costs trajectories · (inputs + 1) evaluations.
struct MorrisOptions {
  Eigen::Index trajectories = 20;  ///< at least 2; more of them, with the same seed, only add rows to the design
  Eigen::Index levels = 4;         ///< p of the grid {0, 1/(p−1), …, 1}, even
  std::uint64_t seed = 1;
  double confidence = 0.95;  ///< of each interval by itself, inside (0, 1)
};

/// What one input does to one quantity. In the quantity's unit per whole range of the input; NaN where too few effects
/// have values: none for means, fewer than two for the rest.
struct ElementaryEffects {
  double mean = 0.0;            ///< μ: the effect's mean over the cube; effects of both signs cancel
  double mean_absolute = 0.0;   ///< μ* (campolongo2007): of its absolute value, by which inputs are ranked
  double deviation = 0.0;       ///< σ: its standard deviation; 0 without curvature and interactions
  double standard_error = 0.0;  ///< of μ*
  double lower = 0.0;           ///< of the interval of μ*, cut at 0
  double upper = 0.0;
  Eigen::Index effects = 0;  ///< that had values; the rest of the trajectories lack one
};

/// Trajectories, inputs + 1 rows each: from a random point of the grid every input moves once, in random order, by
/// Δ = p/(2(p−1)) up or down. Shape trajectories · (inputs + 1) × inputs, coordinates in [0, 1]. Throws InvalidArgument
/// for no input or options outside their domains.
[[nodiscard]] Eigen::MatrixXd morris_design(Eigen::Index inputs, const MorrisOptions& options = {});

/// Effects for each column of `values` (rows of morris_design(inputs, options) × quantities; NaN or an infinity where a
/// row gave no value); result[quantity][input].
///
/// Trajectories are independent, each has one effect of an input: the interval is μ* ± Student's t with effects − 1
/// degrees of freedom times standard error, for the mean over the grid's points. It holds its confidence as far as a mean
/// of that many effects is normally distributed; rare large effects, as of a threshold, need more trajectories.
///
/// An effect that lacks one of its two values is left out and not imputed. Throws InvalidArgument where `values` has not
/// the rows of the design.
[[nodiscard]] std::vector<std::vector<ElementaryEffects>> morris_effects(const Eigen::MatrixXd& values,
                                                                         Eigen::Index inputs,
                                                                         const MorrisOptions& options = {});

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Shapes of effects that a grid does not come near.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <wheelwright/gap/prepared.hpp>

namespace wheelwright {

/// How add_tuned_shapes() searches.
struct TuneOptions {
  std::size_t shapes = 3;     ///< effects with at least so many continuous shapes are tuned: a grid of them is coarse
  double gain = 0.05;         ///< share of what the other causes leave that the effect must take off already
  std::size_t samples = 100;  ///< random points of the shapes
  std::size_t descents = 4;   ///< local searches
  std::size_t steps = 200;    ///< most evaluations of each
  std::uint64_t seed = 1;     ///< of the random points
  std::size_t threads = 1;    ///< the result does not depend on it
};

/// Adds to `grids` the best shapes of every effect with many of them: those that leave least in the best set of
/// `looked_at` (Selection::looked_at on the table of `problem`) that has it, its other causes' shapes tuned along. By simplices
/// from random points and from where the grid was best, since such effects (play that is crossed, or just not) are not
/// smooth in their shapes. Errors held out are compared later, as of all other points.
void add_tuned_shapes(ShapeGrids& grids, const PreparedGap& prepared, const GapProblem& problem,
                      const std::vector<CauseSet>& looked_at, const TuneOptions& options = {});

}  // namespace wheelwright

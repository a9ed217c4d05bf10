// SPDX-License-Identifier: Apache-2.0
/// \file
/// Minimising a function that is neither smooth nor convex over a cube, without derivatives.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace wheelwright {

/// How a cube is searched.
struct SearchOptions {
  std::size_t samples = 400;  ///< random points that are looked at first
  std::size_t descents = 6;   ///< best of these from which a local search starts
  std::size_t steps = 500;    ///< most evaluations of each local search
  double tolerance = 1e-4;    ///< a local search ends when the value falls by less than this share
  std::uint64_t seed = 1;     ///< of the random points
  std::size_t threads = 1;    ///< the result does not depend on it
  std::function<void(double share)> progress = {};  ///< told from the calling thread; may be empty
};

/// The best point that was met.
struct SearchResult {
  std::vector<double> x;
  double value = 0.0;
  std::size_t evaluations = 0;
};

/// Minimises `f` over [0, 1]^dimension: random points of a seeded generator and `starts`, then from the best ones a local
/// search by simplices that begin anew and smaller where the last one stood still (Nelder and Mead 1965, in NLopt). On
/// functions with kinks, like widths of bounds, they came further than BOBYQA and Sbplx for as many evaluations. Deterministic. `f` is called from several threads
/// where there are, must be pure and finite; a point where it throws InvalidArgument is passed over. Throws
/// InvalidArgument when the dimension is 0 or f is nowhere defined.
[[nodiscard]] SearchResult minimise_over_cube(const std::function<double(std::span<const double>)>& f,
                                              std::size_t dimension, const std::vector<std::vector<double>>& starts,
                                              const SearchOptions& options = {});

}  // namespace wheelwright

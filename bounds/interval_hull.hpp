// SPDX-License-Identifier: Apache-2.0
/// \file
/// The interval hull of a feasible set alone, without its facets: 2p linear programs over all rows at once.
#pragma once

#include <cstddef>
#include <vector>

#include <wheelwright/bounds/cutting_planes.hpp>
#include <wheelwright/bounds/slab_columns.hpp>

namespace wheelwright {

/// Options of interval_hull().
struct IntervalHullOptions {
  std::vector<std::size_t> excluded_samples;  ///< row numbers left out, any order (regression sources only)
  std::size_t threads = 1;                    ///< for rows in memory; the result does not depend on it
  std::size_t most_rows = 1 << 20;            ///< half-spaces kept between passes; less means more passes
};

/// Result of interval_hull().
struct IntervalHull {
  bool empty = false;                      ///< proved empty: contradiction holds, hull is the prior box
  Box hull;                                ///< certified: contains the feasible set
  std::vector<CertifiedBound> lower;       ///< per parameter: certified minimum, and the rows with multipliers that
                                           ///< prove it
  std::vector<CertifiedBound> upper;       ///< per parameter: certified maximum
  std::vector<WeightedRow> contradiction;  ///< Farkas certificate where empty
  std::size_t passes = 0;                  ///< walks over all rows
  std::size_t candidates = 0;              ///< rows that were more than looked at
};

/// Interval hull of { θ in prior : |y − Y°θ| <= dy, |Y° − Y| <= dY for every row }.
///
/// A set is cut with an evenly spread sample first (some 16 000 rows); then every pass over the rows compares each with
/// a box around the set held and keeps what may cut, until the 2p vertices where a parameter is smallest or largest
/// satisfy all of these. One pass over rows in memory, or two over a source (the first surveys it), as long as the rows
/// that matter fit into `most_rows`. Bounds are certified (certificate.hpp). Signs that the prior leaves open in noisy
/// columns are relaxed to the chords of SlabRows; feasible_set() examines them one by one.
///
/// Throws InvalidArgument unless the prior is finite, shapes agree and numbers are finite.
[[nodiscard]] IntervalHull interval_hull(const SlabColumns& rows, const Box& prior,
                                         const IntervalHullOptions& options = {});
/// The same for a regression that is walked block by block.
[[nodiscard]] IntervalHull interval_hull(RegressionSource& source, const Box& prior,
                                         const IntervalHullOptions& options = {});

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The guaranteed interval hull when any few instants of the log may be wrong: over all choices, not one explanation.
#pragma once

#include <cstddef>
#include <vector>

#include <wheelwright/bounds/cutting_planes.hpp>
#include <wheelwright/core/regression.hpp>

namespace wheelwright {

/// Options of hull_with_outliers().
struct OutlierHullOptions {
  std::size_t most = 1;       ///< q, the most instants that may be violated
  std::size_t budget = 5000;  ///< most sets tried per bound (and round) before the fallback takes over
  std::vector<std::size_t> excluded_samples = {};  ///< row numbers left out beforehand, any order
};

/// A bound of one parameter over all choices of at most q instants.
struct OutlierBound {
  double value = 0.0;  ///< never inside the exact bound
  bool exact = true;   ///< attained, to rounding, at `at`; false: an outer bound (the fallback)
  std::vector<std::size_t>
      dropped;  ///< instants, ascending, without which the bound is reached; at most q where `exact`
  std::vector<WeightedRow> binding;  ///< rows with multipliers that prove the bound without `dropped`
  Eigen::VectorXd at;                ///< θ where it is reached, uncertified; of size 0 where unknown
};

/// Rows that contradict each other although some instants are dropped.
struct OutlierContradiction {
  std::vector<std::size_t> dropped;  ///< instants, ascending
  std::vector<WeightedRow> rows;  ///< Farkas certificate over the prior box (proves_empty), none of them of `dropped`
};

/// Result of hull_with_outliers().
struct OutlierHull {
  bool empty = false;               ///< proved: no θ of the prior violates at most q instants; hull is the prior box
  Box hull;                         ///< certified: contains every θ that violates at most q instants
  Box layers;                       ///< the fallback: certified too, and the box within which `binding` are proofs
  std::vector<OutlierBound> lower;  ///< per parameter: minimum over all choices
  std::vector<OutlierBound> upper;  ///< per parameter: maximum over all choices
  /// Where empty: contradictions of which any choice of q instants leaves at least one untouched.
  std::vector<OutlierContradiction> contradictions;
  std::size_t sets = 0;     ///< sets bounded in all, one linear program each
  std::size_t passes = 0;   ///< walks over all rows
  std::size_t rounds = 0;   ///< searches, each followed by a pass
  std::size_t working = 0;  ///< half-spaces held
};

/// Interval hull of { θ in prior : all rows of all instants but at most q hold }, the union over all choices of q
/// instants (q-relaxed intersection: Jaulin 2009, "Robust set-membership state estimation", Automatica 45). An instant
/// is dropped with all its outputs. Row sets are those of interval_hull(): chords where a sign is open.
///
/// Two facts are used. A proof of a bound (its binding rows) or of emptiness (Farkas) holds for every choice that spares
/// its instants. Hence
/// - *branching*: only choices that drop one of the at most p binding instants (p + 1 of a contradiction) can lead
///   further out; branching over them q times visits every choice that matters, a set of dropped instants once: at most
///   Σ_{d<=q} (p + 1)^d sets per bound.
/// - *layers*: bind, drop all that bound, bind again, q + 1 times. The proofs have no instant in common, q instants
///   cannot touch them all, so that the loosest of the q + 1 bounds holds for every choice. This bounds a branch (which
///   is cut off where it cannot exceed what was found by more than 1e-12 of the width), and is the fallback where
///   the budget ends: guaranteed, but wider.
///
/// The search works on few half-spaces, which can only make it wider; a pass over the source then looks for rows that the
/// points found violate, and adds the worst, until there are none: the bounds are attained then. Passes: 2(q + 1) for
/// the layers of the hull, one to survey, one per round.
///
/// Bounds are certified, emptiness proved. The result does not depend on how the source is cut into blocks. Throws
/// InvalidArgument unless the prior is finite, shapes agree and numbers are finite.
[[nodiscard]] OutlierHull hull_with_outliers(RegressionSource& source, const Box& prior,
                                             const OutlierHullOptions& options = {});

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
/// \file
/// The feasible set when a few instants of the log may be wrong (relaxed intersection).
#pragma once

#include <vector>

#include <wheelwright/bounds/feasible_set.hpp>

namespace wheelwright::bounds {

/// Options of feasible_set_with_outliers().
struct OutlierOptions {
  std::size_t most = 0;      ///< q, the most instants that may be dropped
  std::size_t budget = 200;  ///< most feasible sets computed by the exact search before the heuristic takes over
  FeasibleSetOptions set;    ///< of every feasible set; its excluded_samples are left out from the beginning
};

/// Result of feasible_set_with_outliers().
struct OutlierResult {
  FeasibleSet set;                   ///< with `dropped` left out; empty where q instants do not suffice
  std::vector<std::size_t> dropped;  ///< row numbers of the dropped instants, ascending; none where `set` is empty
  bool minimal = true;               ///< proved: no smaller number of instants suffices (where set is empty: no q do)
  std::size_t sets = 0;              ///< feasible sets computed
};

/// The feasible set after dropping the smallest number d <= q of instants (all their rows) that makes it non-empty.
/// With d = 0 it is feasible_set(). Where several choices of d instants would do, the first found is returned: it is
/// one consistent explanation, not the union over all of them.
///
/// Exact while the budget lasts: every choice that makes the set non-empty must drop a member of every contradiction,
/// so the search branches over the members of the one just found, layer by layer. Beyond the budget a heuristic drops,
/// again and again, the member of the present contradiction with the largest share λ(a·θ − b) in it at the
/// least-squares estimate θ of the rows still there, and `minimal` is false; it also is where open signs of noisy
/// columns needed several parts, whose contradictions differ.
[[nodiscard]] OutlierResult feasible_set_with_outliers(core::RegressionSource& source, const Box& prior,
                                                       const OutlierOptions& options);

}  // namespace wheelwright::bounds

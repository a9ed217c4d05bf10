// SPDX-License-Identifier: Apache-2.0
/// \file
/// The feasible parameter set of a regression with bounded errors: Assumption 1 of the paper, made computable; and the
/// set when a few instants of the log may be wrong (relaxed intersection).
#pragma once

#include <optional>
#include <vector>

#include "bounds/polytope.hpp"
#include "core/regression.hpp"

namespace wheelwright::bounds {

/// Options of feasible_set().
struct FeasibleSetOptions {
  std::vector<std::size_t> excluded_samples;  ///< row numbers (RegressionBlock::sample) left out, any order
  PolytopeOptions polytope;                   ///< of the result
};

/// Result of feasible_set().
struct FeasibleSet {
  /// What the data say.
  enum class Status {
    nonempty,  ///< not proved empty: polytope, hull, lower and upper hold
    empty,     ///< proved empty: contradiction holds, polytope is absent, hull is the prior box
  };
  Status status = Status::nonempty;
  std::optional<Polytope> polytope;   ///< contains the feasible set; equals it (to rounding) unless `convexified`
  Box hull;                           ///< certified interval hull of the feasible set
  std::vector<CertifiedBound> lower;  ///< per parameter: certified minimum and the rows that prove it
  std::vector<CertifiedBound> upper;  ///< per parameter: certified maximum and the rows that prove it
  /// Where empty: rows that, with the prior box, contradict each other, proved by multipliers in outward arithmetic
  /// (proves_empty); at most p + 1, and no proof is found with any of them left out. Where sign parts were needed, the
  /// contradiction of the first part.
  std::vector<WeightedRow> contradiction;
  std::size_t passes = 0;       ///< passes over the source
  std::size_t rows = 0;         ///< rows in a pass
  std::size_t working_set = 0;  ///< largest number of half-spaces held at once
  std::size_t undecided = 0;    ///< rows left out: found contradictory in floating point, but without proof
  std::size_t sign_parts = 1;   ///< parts examined, one per pattern of open signs of noisy columns
  bool convexified = false;     ///< several parts are not empty: polytope is a convex outer set of their union
};

/// { θ in prior : for every row there is |Y° − Y| <= dY with |y − Y°θ| <= dy }, by cutting planes.
///
/// Two passes over the source (one to learn scales and structure, one to cut; more where sign parts are needed), memory
/// for the working set only. Bounds are certified: never inside the exact ones. The result does not depend on how the
/// source is cut into blocks.
///
/// Where θ_j may have either sign and its column has dY ≠ 0, the set is a union over the signs: each part is bounded
/// and the hull of the parts is taken; with more than four such parameters the convex outer description of SlabRows
/// serves.
///
/// `prior` must be finite. Throws InvalidArgument when shapes disagree or a number is not finite.
[[nodiscard]] FeasibleSet feasible_set(core::RegressionSource& source, const Box& prior,
                                       const FeasibleSetOptions& options = {});

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

namespace wheelwright {
using bounds::feasible_set;
using bounds::FeasibleSet;
}  // namespace wheelwright

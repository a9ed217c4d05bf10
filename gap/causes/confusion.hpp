// SPDX-License-Identifier: Apache-2.0
/// \file
/// Practically indistinguishable effects on a log, and effects that the log does not excite.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "gap/causes/candidate.hpp"
#include "gap/diagnosis.hpp"
#include "gap/effects/effect.hpp"

namespace wheelwright::gap {

/// Signature of one effect in the rows: Σ weight·column of a candidate's own columns.
struct Signature {
  std::size_t candidate = 0;
  Eigen::VectorXd weights;  ///< of own_columns()
};

/// Candidate::own, or all columns where it is empty.
[[nodiscard]] const std::vector<std::size_t>& own_columns(const Candidate& candidate);

/// The signature of each effect as it fits the response of `table` best by itself, θ fitted again beside it (or held,
/// where it is trusted); nothing for an effect without candidates or whose signature θ explains. An effect that leaves
/// more than 90 % of what is there without it at every shape is not on the log: its shape is then the one in the middle
/// of its candidates, not what fits noise.
[[nodiscard]] std::vector<std::optional<Signature>> signatures(const CandidateTable& table, BaseModel base);

/// Explained fraction of signature `a` by the own columns of `b` beside θ, in [0, 1]; 1 where θ alone explains it.
[[nodiscard]] double made_up(const CandidateTable& table, const Signature& a, const Signature& b, BaseModel base);

/// The first effect called `name` that has a signature of `of_effect` (signatures()), which stands for all laws of this
/// name; the number of effects where none has.
[[nodiscard]] std::size_t first_of_name(const CandidateTable& table,
                                        const std::vector<std::optional<Signature>>& of_effect,
                                        const std::string& name);

/// Pairs of effects (first_of_name) of which, of `of_effect` (signatures()), the one explains at least `least` of the
/// other's signature, most alike first; of the two directions the larger similarity counts.
[[nodiscard]] std::vector<ConfusablePair> confusable_pairs(const CandidateTable& table,
                                                           const std::vector<std::optional<Signature>>& of_effect,
                                                           BaseModel base, double least = 0.9);

/// Sentences on effects that leave no trace on this log: they do not apply, their columns are zero, or θ explains all
/// but `least` of them; with what would show them.
[[nodiscard]] std::vector<std::string> not_excited(const CandidateTable& table, const std::vector<Effect>& catalogue,
                                                   const Drive& drive, double least = 1e-3);

}  // namespace wheelwright::gap

// SPDX-License-Identifier: Apache-2.0
/// \file
/// Which effects look alike on a log, and which it could not show.
#pragma once

#include <string>
#include <vector>

#include <wheelwright/gap/candidate.hpp>
#include <wheelwright/gap/diagnosis.hpp>
#include <wheelwright/gap/effect.hpp>

namespace wheelwright {

/// Pairs of effects of which the one makes up at least `least` of the other's signature, θ fitted again beside both (or
/// held, where it is trusted), most alike first. An effect's signature is what its columns add with the coefficients that fit this log best, at the shape that
/// fits best; of the two directions the larger similarity counts.
[[nodiscard]] std::vector<ConfusablePair> confusable_pairs(const CandidateTable& table, BaseModel base,
                                                           double least = 0.9);

/// Sentences on effects that leave no trace on this log: they do not apply, their columns are zero, or θ makes up all but
/// `least` of them; with what would show them.
[[nodiscard]] std::vector<std::string> not_excited(const CandidateTable& table, const std::vector<Effect>& catalogue,
                                                   const Drive& drive, double least = 1e-3);

}  // namespace wheelwright

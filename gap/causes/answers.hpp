// SPDX-License-Identifier: Apache-2.0
/// \file
/// Answers: credible sets of causes that are the same to whoever mends the robot.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gap/causes/selection.hpp"
#include "gap/diagnosis.hpp"
#include "gap/effects/effect.hpp"
#include "gap/prepared.hpp"

namespace wheelwright::gap {

/// Which members of `set` are reported: a parametric cause that is the common part (Effect::common) of another member
/// is one with it.
[[nodiscard]] std::vector<bool> reported(const CandidateTable& table, const std::vector<Effect>& catalogue,
                                         const CauseSet& set);

/// Their names.
[[nodiscard]] std::vector<std::string> reported_names(const CandidateTable& table, const std::vector<Effect>& catalogue,
                                                      const CauseSet& set);

/// What sets of one answer have in common, ascending: the families of the set's causes (Effect::family, or the name of
/// an effect without one), its trifles left out.
[[nodiscard]] std::vector<std::string> answer_of(const CredibleCauses& set, const std::vector<Effect>& catalogue);

/// Numbers the sets by answer_of(), from 0 in the order in which answers come first, and returns how many there are.
std::size_t number_answers(std::vector<CredibleCauses>& credible, const std::vector<Effect>& catalogue);

/// Gives each cause of `diagnosis` that has a family the laws of that family between which the log does not tell: those
/// of the credible sets of the first answer, each fitted with the rest of its set and `base` as the causes were.
/// `found` is what the causes and credible sets of `diagnosis` are of, on `problem`.
void add_laws(Diagnosis& diagnosis, const Selection& found, const PreparedGap& prepared, const GapProblem& problem,
              BaseModel base, const BlockOptions& blocks);

}  // namespace wheelwright::gap

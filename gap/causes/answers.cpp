// SPDX-License-Identifier: Apache-2.0
#include "gap/causes/answers.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "gap/causes/estimates.hpp"

namespace wheelwright::gap {
namespace {

std::string family_or_name(const std::string& name, const std::vector<Effect>& catalogue) {
  const Effect* effect = find_effect(catalogue, name);
  return effect == nullptr || effect->family.empty() ? name : effect->family;
}

bool names_just(const CredibleCauses& listed, const std::vector<std::string>& names) {
  return std::ranges::is_permutation(listed.effects, names);
}

}  // namespace

std::vector<bool> reported(const CandidateTable& table, const std::vector<Effect>& catalogue, const CauseSet& set) {
  std::vector<bool> shown(set.members.size(), true);
  for (std::size_t k = 0; k < set.members.size(); ++k) {
    const std::string& name = table.names[table.candidates[set.members[k]].effect];
    for (const std::size_t other : set.members) {
      if (catalogue[table.candidates[other].effect].common == name) {
        shown[k] = false;
      }
    }
  }
  return shown;
}

std::vector<std::string> reported_names(const CandidateTable& table, const std::vector<Effect>& catalogue,
                                        const CauseSet& set) {
  const std::vector<bool> shown = reported(table, catalogue, set);
  std::vector<std::string> names;
  for (std::size_t k = 0; k < set.members.size(); ++k) {
    if (shown[k]) {
      names.push_back(table.names[table.candidates[set.members[k]].effect]);
    }
  }
  return names;
}

std::vector<std::string> answer_of(const CredibleCauses& set, const std::vector<Effect>& catalogue) {
  std::vector<std::string> answer;
  for (const std::string& name : set.effects) {
    if (std::ranges::find(set.trifles, name) == set.trifles.end()) {
      answer.push_back(family_or_name(name, catalogue));
    }
  }
  std::ranges::sort(answer);
  return answer;
}

std::size_t number_answers(std::vector<CredibleCauses>& credible, const std::vector<Effect>& catalogue) {
  std::vector<std::vector<std::string>> answers;
  for (CredibleCauses& set : credible) {
    std::vector<std::string> answer = answer_of(set, catalogue);
    const auto known = std::ranges::find(answers, answer);
    set.answer = static_cast<std::size_t>(known - answers.begin());
    if (known == answers.end()) {
      answers.push_back(std::move(answer));
    }
  }
  return answers.size();
}

void add_laws(Diagnosis& diagnosis, const Selection& found, const PreparedGap& prepared, const GapProblem& problem,
              BaseModel base, const BlockOptions& blocks) {
  for (GapCause& cause : diagnosis.causes) {
    cause.family = find_effect(prepared.catalogue, cause.effect)->family;
  }
  const CandidateTable& table = problem.table;
  for (std::size_t i = 1; i < found.credible.size(); ++i) {
    const CauseSet& set = found.credible[i].set;
    const std::vector<std::string> names = reported_names(table, prepared.catalogue, set);
    const bool of_first_answer = std::ranges::any_of(diagnosis.credible, [&](const CredibleCauses& listed) {
      return listed.answer == 0 && names_just(listed, names);
    });
    std::optional<FittedCauses> fitted;
    for (std::size_t k = 0; k < set.members.size() && of_first_answer; ++k) {
      const Effect& effect = prepared.catalogue[table.candidates[set.members[k]].effect];
      const auto cause = std::ranges::find_if(diagnosis.causes, [&](const GapCause& each) {
        return !effect.family.empty() && each.family == effect.family;
      });
      if (cause == diagnosis.causes.end() || cause->effect == effect.name ||
          std::ranges::find(cause->laws, effect.name, &GapLaw::effect) != cause->laws.end()) {
        continue;
      }
      if (!fitted) {
        fitted = fit_causes(prepared, problem, set, base, blocks);
      }
      if (cause->laws.empty()) {
        cause->laws.push_back({cause->effect, cause->sentence, cause->parameters});
      }
      cause->laws.push_back({effect.name, effect.sentence, fitted->numbers[k]});
    }
  }
}

}  // namespace wheelwright::gap

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/candidate.hpp>

#include <algorithm>
#include <limits>
#include <map>
#include <utility>

#include <wheelwright/core/for_all.hpp>

namespace wheelwright::gap {
namespace {

using Members = std::vector<std::size_t>;

struct Grown {
  Members members;
  double error = std::numeric_limits<double>::infinity();
};

class Search {
 public:
  Search(const CandidateTable& table, const CauseSearchOptions& options) : table_(table), options_(options) {
    of_effect_.resize(table.names.size());
    for (std::size_t c = 0; c < table.candidates.size(); ++c) {
      const std::size_t effect = table.candidates[c].effect;
      if (options.allowed.empty() || options.allowed[effect]) {
        of_effect_[effect].push_back(c);
      }
    }
    for (std::size_t e = 0; e < of_effect_.size(); ++e) {
      if (!of_effect_[e].empty()) {
        effects_.push_back(e);
      }
    }
  }

  [[nodiscard]] std::vector<std::vector<CauseSet>> run() const {
    std::vector<std::vector<CauseSet>> sizes{{evaluate(table_, {}, options_.base)}};
    std::vector<Grown> level{{Members{}, sizes[0][0].held_out_error}};
    for (std::size_t size = 1; size <= options_.largest && !level.empty(); ++size) {
      const std::size_t beam = size == 1 ? 1 : size == 2 ? options_.pair_beam : options_.triple_beam;
      level = grow(level, beam);
      std::vector<CauseSet> sets(size == 1 ? level.size() : std::min(level.size(), options_.kept));
      core::for_all(sets.size(), options_.threads,
                    [&](std::size_t i) { sets[i] = evaluate(table_, level[i].members, options_.base); });
      sizes.push_back(std::move(sets));
    }
    return sizes;
  }

 private:
  [[nodiscard]] double error(const Members& members) const {
    return table_.gram->held_out_error(subset_of(table_, members, options_.base));
  }

  // `fixed` with the best shape of `effect` added.
  [[nodiscard]] Grown with_best(const Members& fixed, std::size_t effect) const {
    Grown best;
    for (const std::size_t c : of_effect_[effect]) {
      Members members = fixed;
      members.insert(std::upper_bound(members.begin(), members.end(), c), c);
      const double value = error(members);
      if (value < best.error) {
        best = {std::move(members), value};
      }
    }
    return best;
  }

  // The shape of each member chosen again beside the others, once.
  [[nodiscard]] Grown polished(Grown set) const {
    for (std::size_t k = 0; set.members.size() > 1 && k < set.members.size(); ++k) {
      const std::size_t effect = table_.candidates[set.members[k]].effect;
      if (of_effect_[effect].size() < 2) {
        continue;
      }
      Members others = set.members;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
      Grown again = with_best(others, effect);
      if (again.error < set.error) {
        set = std::move(again);
      }
    }
    return set;
  }

  // Every set of the first `beam` of `level` with every further effect, best first, each combination of effects once.
  [[nodiscard]] std::vector<Grown> grow(const std::vector<Grown>& level, std::size_t beam) const {
    struct Task {
      std::size_t from;
      std::size_t effect;
    };
    std::vector<Task> tasks;
    for (std::size_t i = 0; i < std::min(beam, level.size()); ++i) {
      for (const std::size_t e : effects_) {
        const bool there = std::any_of(level[i].members.begin(), level[i].members.end(),
                                       [&](std::size_t c) { return table_.candidates[c].effect == e; });
        if (!there) {
          tasks.push_back({i, e});
        }
      }
    }
    std::vector<Grown> grown(tasks.size());
    core::for_all(tasks.size(), options_.threads, [&](std::size_t k) {
      grown[k] = polished(with_best(level[tasks[k].from].members, tasks[k].effect));
    });
    std::map<std::vector<std::size_t>, Grown> best;
    for (Grown& set : grown) {
      std::vector<std::size_t> effects;
      for (const std::size_t c : set.members) {
        effects.push_back(table_.candidates[c].effect);
      }
      std::sort(effects.begin(), effects.end());
      const auto at = best.find(effects);
      if (at == best.end()) {
        best.emplace(std::move(effects), std::move(set));
      } else if (set.error < at->second.error) {
        at->second = std::move(set);
      }
    }
    std::vector<Grown> all;
    for (auto& entry : best) {
      all.push_back(std::move(entry.second));
    }
    std::stable_sort(all.begin(), all.end(), [](const Grown& a, const Grown& b) { return a.error < b.error; });
    return all;
  }

  const CandidateTable& table_;
  const CauseSearchOptions& options_;
  std::vector<std::vector<std::size_t>> of_effect_;
  std::vector<std::size_t> effects_;
};

}  // namespace

Subset subset_of(const CandidateTable& table, const std::vector<std::size_t>& members, BaseModel base) {
  Subset subset;
  subset.columns = base == BaseModel::refitted ? table.base : table.unknown;
  subset.sign.assign(subset.columns.size(), 0);
  for (const std::size_t c : members) {
    const Candidate& candidate = table.candidates[c];
    std::vector<std::size_t>& into = candidate.unit_coefficient ? subset.fixed : subset.columns;
    into.insert(into.end(), candidate.columns.begin(), candidate.columns.end());
    if (!candidate.unit_coefficient) {
      subset.sign.insert(subset.sign.end(), candidate.sign.begin(), candidate.sign.end());
    }
  }
  return subset;
}

CauseSet evaluate(const CandidateTable& table, std::vector<std::size_t> members, BaseModel base) {
  const Subset subset = subset_of(table, members, base);
  CauseSet set;
  set.loss = table.gram->held_out_loss(subset);
  set.held_out_error = set.loss.sum() / table.gram->rows().sum();
  const std::size_t theta = (base == BaseModel::refitted ? table.base : table.unknown).size();
  std::size_t numbers = subset.columns.size() - theta;
  for (const std::size_t c : members) {
    numbers += table.candidates[c].shape.size();
  }
  set.coefficients = static_cast<double>(numbers);
  set.members = std::move(members);
  return set;
}

CauseSet evaluate_without(const CandidateTable& table, const CauseSet& set, std::size_t k, BaseModel base) {
  std::vector<std::size_t> others = set.members;
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
  return evaluate(table, std::move(others), base);
}

std::vector<std::size_t> effects_of(const CandidateTable& table, const CauseSet& set) {
  std::vector<std::size_t> effects;
  for (const std::size_t c : set.members) {
    effects.push_back(table.candidates[c].effect);
  }
  std::sort(effects.begin(), effects.end());
  return effects;
}

std::vector<std::string> names_of(const CandidateTable& table, const CauseSet& set) {
  std::vector<std::string> names;
  for (const std::size_t e : effects_of(table, set)) {
    names.push_back(table.names[e]);
  }
  return names;
}

std::vector<std::vector<CauseSet>> search_causes(const CandidateTable& table, const CauseSearchOptions& options) {
  return Search(table, options).run();
}

}  // namespace wheelwright::gap

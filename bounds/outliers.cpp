// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/outliers.hpp>

#include <algorithm>
#include <map>
#include <set>

namespace wheelwright {
namespace {

using Samples = std::set<std::size_t>;

/// Feasible sets with samples left out, and what their contradictions say.
class Trials {
 public:
  Trials(RegressionSource& source, const Box& prior, const OutlierOptions& options)
      : source_(source), prior_(prior), options_(options) {}

  FeasibleSet without(const Samples& dropped) {
    FeasibleSetOptions set = options_.set;
    set.excluded_samples.insert(set.excluded_samples.end(), dropped.begin(), dropped.end());
    ++count;
    FeasibleSet result = feasible_set(source_, prior_, set);
    for (const std::size_t sample : members(result)) {
      ++seen[sample];
    }
    one_part = one_part && result.sign_parts == 1;
    return result;
  }

  static Samples members(const FeasibleSet& set) {
    Samples samples;
    for (const WeightedRow& weighted : set.contradiction) {
      samples.insert(weighted.row.origin.sample);
    }
    return samples;
  }

  std::size_t count = 0;
  std::map<std::size_t, std::size_t> seen;
  bool one_part = true;

 private:
  RegressionSource& source_;
  const Box& prior_;
  const OutlierOptions& options_;
};

OutlierResult answer(FeasibleSet set, const Samples& dropped, bool minimal, std::size_t count) {
  return {std::move(set), {dropped.begin(), dropped.end()}, minimal, count};
}

}  // namespace

OutlierResult feasible_set_with_outliers(RegressionSource& source, const Box& prior, const OutlierOptions& options) {
  Trials trials(source, prior, options);
  FeasibleSet plain = trials.without({});
  if (plain.status == FeasibleSet::Status::nonempty) {
    return answer(std::move(plain), {}, true, trials.count);
  }

  std::map<Samples, Samples> layer{{{}, Trials::members(plain)}};  // dropped so far → the contradiction that is left
  bool exhausted = false;
  for (std::size_t depth = 1; depth <= options.most && !exhausted; ++depth) {
    std::map<Samples, Samples> next;
    for (const auto& [dropped, contradiction] : layer) {
      for (const std::size_t sample : contradiction) {
        Samples more = dropped;
        more.insert(sample);
        if (next.contains(more)) {
          continue;
        }
        if (trials.count >= options.budget) {
          exhausted = true;
          break;
        }
        FeasibleSet set = trials.without(more);
        if (set.status == FeasibleSet::Status::nonempty) {
          return answer(std::move(set), more, trials.one_part, trials.count);
        }
        next.emplace(std::move(more), Trials::members(set));
      }
      if (exhausted) {
        break;
      }
    }
    layer = std::move(next);
  }
  if (!exhausted) {
    return answer(std::move(plain), {}, trials.one_part, trials.count);
  }

  Samples dropped;
  Samples contradiction = Trials::members(plain);
  while (dropped.size() < options.most && !contradiction.empty()) {
    dropped.insert(*std::max_element(contradiction.begin(), contradiction.end(), [&](std::size_t x, std::size_t y) {
      return trials.seen[x] < trials.seen[y];
    }));
    FeasibleSet set = trials.without(dropped);
    if (set.status == FeasibleSet::Status::nonempty) {
      return answer(std::move(set), dropped, false, trials.count);
    }
    contradiction = Trials::members(set);
  }
  return answer(std::move(plain), {}, false, trials.count);
}

}  // namespace wheelwright

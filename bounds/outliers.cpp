// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/outliers.hpp>

#include <algorithm>
#include <map>
#include <set>

#include <wheelwright/bounds/survey.hpp>

namespace wheelwright::bounds {
namespace {

using SampleSet = std::set<std::size_t>;

/// Feasible sets with samples left out, and what their contradictions say.
class Trials {
 public:
  Trials(core::RegressionSource& source, const Box& prior, const OutlierOptions& options)
      : source_(source), prior_(prior), options_(options) {}

  FeasibleSet without(const SampleSet& dropped) {
    FeasibleSetOptions set = options_.set;
    set.excluded_samples.insert(set.excluded_samples.end(), dropped.begin(), dropped.end());
    ++count;
    FeasibleSet result = feasible_set(source_, prior_, set);
    one_part = one_part && result.sign_parts == 1;
    return result;
  }

  static SampleSet members(const FeasibleSet& set) {
    SampleSet samples;
    for (const WeightedRow& weighted : set.contradiction) {
      samples.insert(weighted.row.origin.sample);
    }
    return samples;
  }

  /// The member of the contradiction of `set`, computed without `dropped`, with the largest share at least squares.
  std::size_t most_suspect(const FeasibleSet& set, const SampleSet& dropped) {
    std::vector<std::size_t> excluded = options_.set.excluded_samples;
    excluded.insert(excluded.end(), dropped.begin(), dropped.end());
    std::sort(excluded.begin(), excluded.end());
    const Eigen::VectorXd theta = weighted_estimate(survey(source_, prior_, excluded), prior_);
    const auto share = [&](const WeightedRow& each) { return each.multiplier * (each.row.a.dot(theta) - each.row.b); };
    const auto suspect = std::max_element(set.contradiction.begin(), set.contradiction.end(),
                                          [&](const auto& x, const auto& y) { return share(x) < share(y); });
    return suspect->row.origin.sample;
  }

  std::size_t count = 0;
  bool one_part = true;

 private:
  core::RegressionSource& source_;
  const Box& prior_;
  const OutlierOptions& options_;
};

OutlierResult answer(FeasibleSet set, const SampleSet& dropped, bool minimal, std::size_t count) {
  return {std::move(set), {dropped.begin(), dropped.end()}, minimal, count};
}

}  // namespace

OutlierResult feasible_set_with_outliers(core::RegressionSource& source, const Box& prior,
                                         const OutlierOptions& options) {
  Trials trials(source, prior, options);
  FeasibleSet plain = trials.without({});
  if (plain.status == FeasibleSet::Status::nonempty) {
    return answer(std::move(plain), {}, true, trials.count);
  }

  std::map<SampleSet, SampleSet> layer{
      {{}, Trials::members(plain)}};  // dropped so far → the contradiction that is left
  bool exhausted = false;
  for (std::size_t depth = 1; depth <= options.most && !exhausted; ++depth) {
    std::map<SampleSet, SampleSet> next;
    for (const auto& [dropped, contradiction] : layer) {
      for (const std::size_t sample : contradiction) {
        SampleSet more = dropped;
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

  SampleSet dropped;
  FeasibleSet set = plain;
  while (dropped.size() < options.most && !set.contradiction.empty()) {
    dropped.insert(trials.most_suspect(set, dropped));
    set = trials.without(dropped);
    if (set.status == FeasibleSet::Status::nonempty) {
      return answer(std::move(set), dropped, false, trials.count);
    }
  }
  return answer(std::move(plain), {}, false, trials.count);
}

}  // namespace wheelwright::bounds

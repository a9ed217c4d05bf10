// SPDX-License-Identifier: Apache-2.0
#include "bounds/feasible_set.hpp"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "bounds/certificate.hpp"
#include "bounds/cutter.hpp"
#include "bounds/survey.hpp"

namespace wheelwright::bounds {
namespace {

constexpr std::size_t kMostOpenSigns = 4;

/// One cutting pass over a part of the prior box with the convex description of the rows.
FeasibleSet cut(core::RegressionSource& source, const RowSurvey& survey, const Box& prior,
                const std::vector<std::size_t>& excluded, const PolytopeOptions& options) {
  Cutter cutter(prior, survey.blocks, survey.information);
  ColumnPacker packer(source.outputs(), prior.dimension());
  const auto offer = [&](const SlabColumns& columns, const std::vector<char>& used) {
    return cutter.offer(columns, used);
  };
  // The evenly spread sample first, so that the set is small before the long walk begins.
  const bool alive =
      packer.walk(survey.sample, offer) && cutter.tighten() && packer.walk(source, excluded, offer) && cutter.finish();
  FeasibleSet result;
  result.passes = 1;
  result.rows = survey.rows;
  result.working_set = cutter.working_set();
  result.undecided = cutter.undecided();
  result.hull = prior;
  if (!alive) {
    result.status = FeasibleSet::Status::empty;
    result.contradiction = cutter.contradiction();
    return result;
  }
  auto intersection = Polytope::intersect(cutter.half_spaces(), prior, options);
  if (auto* contradiction = std::get_if<std::vector<WeightedRow>>(&intersection)) {
    result.status = FeasibleSet::Status::empty;
    result.contradiction = std::move(*contradiction);
    return result;
  }
  result.polytope = std::move(std::get<Polytope>(intersection));
  result.hull = result.polytope->hull();
  result.lower = result.polytope->lower();
  result.upper = result.polytope->upper();
  return result;
}

/// Adds what it cost to get `part`.
void account(FeasibleSet& total, const FeasibleSet& part) {
  total.passes += part.passes;
  total.working_set = std::max(total.working_set, part.working_set);
  total.undecided += part.undecided;
}

/// Hull of two non-empty parts.
void merge(FeasibleSet& all, const FeasibleSet& part) {
  all.hull = hull(all.hull, part.hull);
  for (std::size_t j = 0; j < all.lower.size(); ++j) {
    if (part.lower[j].value < all.lower[j].value) {
      all.lower[j] = part.lower[j];
    }
    if (part.upper[j].value > all.upper[j].value) {
      all.upper[j] = part.upper[j];
    }
  }
}

}  // namespace

FeasibleSet feasible_set(core::RegressionSource& source, const Box& prior, const FeasibleSetOptions& options) {
  std::vector<std::size_t> excluded = options.excluded_samples;
  std::sort(excluded.begin(), excluded.end());
  const RowSurvey known = survey(source, prior, excluded);
  FeasibleSet convex = cut(source, known, prior, excluded, options.polytope);
  ++convex.passes;
  if (convex.status == FeasibleSet::Status::empty || open_signs(known, prior).empty()) {
    return convex;
  }

  // Signs that the convex outer set already decides are open no more.
  Box decided = prior;
  for (const std::size_t j : open_signs(known, prior)) {
    if (convex.hull.sides[j].lower >= 0.0) {
      decided.sides[j].lower = 0.0;
    } else if (convex.hull.sides[j].upper <= 0.0) {
      decided.sides[j].upper = 0.0;
    }
  }
  const std::vector<std::size_t> open = open_signs(known, decided);
  if (open.size() > kMostOpenSigns) {
    convex.convexified = true;
    return convex;
  }
  FeasibleSet result;
  std::size_t nonempty = 0;
  FeasibleSet cost;
  account(cost, convex);
  const std::size_t parts = std::size_t{1} << open.size();
  std::vector<WeightedRow> contradiction;
  for (std::size_t pattern = 0; pattern < parts; ++pattern) {
    Box box = decided;
    for (std::size_t i = 0; i < open.size(); ++i) {
      Interval& side = box.sides[open[i]];
      ((pattern >> i & 1) != 0 ? side.upper : side.lower) = 0.0;
    }
    FeasibleSet part = cut(source, known, box, excluded, options.polytope);
    account(cost, part);
    if (part.status == FeasibleSet::Status::empty) {
      if (contradiction.empty()) {
        contradiction = part.contradiction;
      }
    } else if (nonempty++ == 0) {
      result = std::move(part);
    } else {
      merge(result, part);
    }
  }
  if (nonempty == 0) {
    result.status = FeasibleSet::Status::empty;
    result.hull = prior;
    result.contradiction = std::move(contradiction);
  } else if (nonempty > 1) {
    // The convex description over the hull of the parts: the chords are shortest there.
    FeasibleSet outer = cut(source, known, result.hull, excluded, options.polytope);
    account(cost, outer);
    result.polytope = outer.polytope ? outer.polytope : convex.polytope;
    result.convexified = true;
  }
  result.rows = known.rows;
  result.passes = cost.passes;
  result.working_set = cost.working_set;
  result.undecided = cost.undecided;
  result.sign_parts = parts;
  return result;
}

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

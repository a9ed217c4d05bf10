// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/bounds/interval_hull.hpp>

#include <algorithm>
#include <functional>
#include <numeric>

#include <wheelwright/bounds/cutter.hpp>
#include <wheelwright/bounds/spread_sample.hpp>
#include <wheelwright/bounds/survey.hpp>

namespace wheelwright {
namespace {

constexpr std::size_t kMostPasses = 16;

IntervalHull hull_of(Cutter& cutter, const Box& prior, const std::function<bool()>& pass) {
  IntervalHull result;
  result.hull = prior;
  bool alive = cutter.tighten();
  do {
    cutter.begin_pass();
    alive = alive && pass() && cutter.finish();
    ++result.passes;
  } while (alive && cutter.again() && result.passes < kMostPasses);
  result.candidates = cutter.candidates();
  result.empty = !alive;
  if (!alive) {
    result.contradiction = cutter.contradiction();
    return result;
  }
  std::tie(result.lower, result.upper) = cutter.certified_hull();
  for (std::size_t j = 0; j < prior.dimension(); ++j) {
    const double low = result.lower[j].value, high = result.upper[j].value;
    result.hull.sides[j] = {std::min(low, high), std::max(low, high)};
  }
  return result;
}

}  // namespace

IntervalHull interval_hull(const SlabColumns& rows, const Box& prior, const IntervalHullOptions& options) {
  check::that(prior.dimension() > 0 && rows.parameters() == prior.dimension(), "prior box",
              "one side per parameter of the regression");
  check_finite(prior, "prior box");
  const SpreadSample sample(rows);
  std::vector<std::size_t> everyone(prior.dimension());
  std::iota(everyone.begin(), everyone.end(), std::size_t{0});
  Cutter cutter(prior, {everyone}, sample.information(prior),
                {.facets = false, .most = options.most_rows, .threads = options.threads});
  if (!sample.each_level([&](const SlabColumns& level) { return cutter.offer(level) && cutter.tighten(); })) {
    return hull_of(cutter, prior, [] { return false; });
  }
  return hull_of(cutter, prior, [&] { return cutter.offer(rows); });
}

IntervalHull interval_hull(RegressionSource& source, const Box& prior, const IntervalHullOptions& options) {
  std::vector<std::size_t> excluded = options.excluded_samples;
  std::sort(excluded.begin(), excluded.end());
  const RowSurvey known = survey(source, prior, excluded);
  Cutter cutter(prior, known.blocks, known.information, {.facets = false, .most = options.most_rows});
  ColumnPacker packer(source.outputs(), prior.dimension());
  const auto offer = [&](const SlabColumns& columns, const std::vector<char>& used) {
    return cutter.offer(columns, used);
  };
  const bool alive = packer.walk(known.sample, offer);
  IntervalHull result = hull_of(cutter, prior, [&] { return alive && packer.walk(source, excluded, offer); });
  ++result.passes;
  return result;
}

}  // namespace wheelwright

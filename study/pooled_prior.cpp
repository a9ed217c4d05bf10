// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/study/pooled_prior.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include <wheelwright/core/check.hpp>
#include <wheelwright/core/limits.hpp>
#include <wheelwright/core/statistics.hpp>

namespace wheelwright::study {
namespace {

constexpr std::size_t fewest_learning = 5;
constexpr double hidden_width = 0.5;  // bounds wider than this share of the prior show nothing

// FNV-1a of the name, mixed with the seed by splitmix64's finaliser.
std::uint64_t hash_of(const std::string& name, std::uint64_t seed) {
  std::uint64_t h = 0xcbf29ce484222325U;
  for (const char c : name) {
    h = (h ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  }
  h += 0x9e3779b97f4a7c15U * (seed + 1);
  h = (h ^ (h >> 30U)) * 0xbf58476d1ce4e5b9U;
  h = (h ^ (h >> 27U)) * 0x94d049bb133111ebU;
  return h ^ (h >> 31U);
}

// Robots that could be read, in an order that depends on their names and the seed alone.
std::vector<std::size_t> shuffled(const FleetTable& table, std::uint64_t seed) {
  std::vector<std::pair<std::uint64_t, std::size_t>> keys;
  for (std::size_t i = 0; i < table.robots.size(); ++i) {
    if (table.status[i] != RobotStatus::unreadable) {
      keys.emplace_back(hash_of(table.robots[i], seed), i);
    }
  }
  std::sort(keys.begin(), keys.end(), [&](const auto& a, const auto& b) {
    return a.first != b.first ? a.first < b.first : table.robots[a.second] < table.robots[b.second];
  });
  std::vector<std::size_t> order;
  for (const auto& [key, robot] : keys) {
    order.push_back(robot);
  }
  return order;
}

bool shown(const FleetEntry& e) { return e.upper - e.lower <= hidden_width * (e.prior.upper - e.prior.lower); }

// Centre, scales and the hull of the priors. `learns` says of each robot of the table whether it is of the first half.
PooledParameter learn(const FleetColumn& column, std::size_t at, const std::vector<bool>& learns, std::size_t learning,
                      double most_hidden) {
  PooledParameter out{.column = at, .before = {core::kInfinity, -core::kInfinity}};
  std::vector<double> middles, below, above;
  std::size_t seen = 0;
  for (const FleetEntry& e : column.entries) {
    out.before = {std::min(out.before.lower, e.prior.lower), std::max(out.before.upper, e.prior.upper)};
    if (learns[e.robot] && shown(e)) {
      ++seen;
      middles.push_back(e.lower + 0.5 * (e.upper - e.lower));
    }
  }
  out.box = out.before;
  out.hidden = learning == 0 ? 1.0 : 1.0 - static_cast<double>(seen) / static_cast<double>(learning);
  if (out.hidden > most_hidden || seen < fewest_learning) {
    out.reason = fmt::format("{:.3g} % of the learning robots do not show it", 100.0 * out.hidden);
    return out;
  }
  out.centre = core::median(middles);
  for (const FleetEntry& e : column.entries) {
    if (learns[e.robot] && shown(e)) {
      below.push_back(std::max(out.centre - e.lower, 0.0));
      above.push_back(std::max(e.upper - out.centre, 0.0));
    }
  }
  const double least = 1e-9 * std::max(std::abs(out.centre), std::numeric_limits<double>::min());
  out.scale_below = std::max(core::median(below), least);
  out.scale_above = std::max(core::median(above), least);
  out.included = true;
  return out;
}

std::vector<double> scores_of(const FleetTable& table, const std::vector<PooledParameter>& parameters) {
  std::vector<double> scores(table.robots.size(), 0.0);
  std::vector<std::size_t> met(table.robots.size(), 0);
  std::size_t included = 0;
  for (const PooledParameter& p : parameters) {
    if (!p.included) {
      continue;
    }
    ++included;
    for (const FleetEntry& e : table.columns[p.column].entries) {
      ++met[e.robot];
      const double below = (p.centre - e.lower) / p.scale_below, above = (e.upper - p.centre) / p.scale_above;
      scores[e.robot] = std::max(scores[e.robot], std::max(below, above));
    }
  }
  for (std::size_t i = 0; i < scores.size(); ++i) {
    if (met[i] < included) {
      scores[i] = core::kInfinity;
    }
  }
  return scores;
}

std::size_t needed_for(double coverage) {
  std::size_t m = 1;
  while (static_cast<double>(m) < coverage * static_cast<double>(m + 1) * (1.0 - 1e-12)) {
    ++m;
  }
  return 2 * std::max(m, fewest_learning);
}

}  // namespace

PooledPrior pooled_prior(const FleetTable& table, const PooledPriorOptions& options) {
  check::that(options.coverage > 0.0 && options.coverage < 1.0, "coverage", "in (0, 1)");
  check::that(options.most_hidden >= 0.0 && options.most_hidden <= 1.0, "most_hidden", "in [0, 1]");
  const std::vector<std::size_t> order = shuffled(table, options.seed);
  PooledPrior out;
  out.asked = options.coverage;
  out.learning = order.size() / 2;
  out.scored = order.size() - out.learning;
  out.needed = needed_for(options.coverage);
  std::vector<bool> learns(table.robots.size(), false);
  for (std::size_t k = 0; k < out.learning; ++k) {
    learns[order[k]] = true;
  }
  for (std::size_t j = 0; j < table.columns.size(); ++j) {
    if (table.columns[j].is_prior_key) {
      out.parameters.push_back(learn(table.columns[j], j, learns, out.learning, options.most_hidden));
    }
  }
  const double m = static_cast<double>(out.scored);
  out.rank = static_cast<std::size_t>(std::ceil(options.coverage * (m + 1.0) * (1.0 - 1e-12)));
  if (order.size() < out.needed || out.rank > out.scored) {
    out.message = fmt::format(
        "{} readable robots are too few for a box with a coverage of {:.3g} %: {} are needed, half of them to learn "
        "from",
        order.size(), 100.0 * options.coverage, out.needed);
    return out;
  }
  if (std::none_of(out.parameters.begin(), out.parameters.end(), [](const auto& p) { return p.included; })) {
    out.message = "no parameter is shown by enough robots";
    return out;
  }
  const std::vector<double> all = scores_of(table, out.parameters);
  std::vector<double> scores;
  for (std::size_t k = out.learning; k < order.size(); ++k) {
    scores.push_back(all[order[k]]);
    out.boundless += std::isinf(scores.back()) ? 1 : 0;
  }
  std::sort(scores.begin(), scores.end());
  out.radius = scores[out.rank - 1];
  if (std::isinf(out.radius)) {
    out.message = fmt::format("{} of {} robots gave no bounds: more than a coverage of {:.3g} % allows", out.boundless,
                              out.scored, 100.0 * options.coverage);
    return out;
  }
  const Interval radius = {out.radius, out.radius};
  std::size_t included = 0;
  for (PooledParameter& p : out.parameters) {
    if (p.included) {
      ++included;
      const Interval centre = {p.centre, p.centre};
      // The score was rounded to nearest: one more step outward encloses it.
      const Interval grown = radius * Interval{core::round_down(1.0), core::round_up(1.0)};
      const double low = (centre - grown * Interval{p.scale_below, p.scale_below}).lower;
      const double high = (centre + grown * Interval{p.scale_above, p.scale_above}).upper;
      p.box = {std::max(low, p.before.lower), std::min(high, p.before.upper)};
    }
  }
  out.exists = true;
  out.coverage = static_cast<double>(out.rank) / (m + 1.0);
  out.message = fmt::format(
      "the box of {} parameter{} holds the next robot's with a probability of at least {:.4g} %, learnt from {} robots "
      "and measured on {} others, if they all are drawn alike and their noise keeps to its bounds",
      included, included == 1 ? "" : "s", 100.0 * out.coverage, out.learning, out.scored);
  return out;
}

}  // namespace wheelwright::study

// SPDX-License-Identifier: Apache-2.0
#include "study/population.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/check.hpp"
#include "core/limits.hpp"
#include "core/statistics.hpp"

namespace wheelwright::study {

std::size_t column_of(FleetTable& table, const RecordedParameter& parameter) {
  for (std::size_t j = 0; j < table.columns.size(); ++j) {
    if (table.columns[j].name == parameter.name && table.columns[j].unit == parameter.unit) {
      table.columns[j].warrant = core::weaker(table.columns[j].warrant, parameter.warrant);
      return j;
    }
  }
  table.columns.push_back({.name = parameter.name,
                           .unit = parameter.unit,
                           .is_prior_key = parameter.is_prior_key,
                           .warrant = parameter.warrant});
  return table.columns.size() - 1;
}

void add(FleetTable& table, const RobotRecord& record) {
  constexpr double none = std::numeric_limits<double>::quiet_NaN();
  const std::size_t robot = table.robots.size();
  table.robots.push_back(record.robot);
  table.status.push_back(record.commissioning.status);
  for (const RecordedParameter& p : record.commissioning.parameters) {
    const std::size_t column = column_of(table, p);
    table.columns[column].entries.push_back({.robot = robot,
                                             .estimate = p.estimate.value_or(none),
                                             .standard_error = p.standard_error.value_or(none),
                                             .freedom = p.freedom.value_or(std::numeric_limits<double>::infinity()),
                                             .lower = p.lower,
                                             .upper = p.upper,
                                             .prior = p.prior});
  }
}

namespace {

constexpr double kHuber = 1.5;

// Moments of ψ at the standard normal distribution.
struct HuberMoments {
  double inside = std::erf(kHuber / std::numbers::sqrt2);  // P(|Z| < kHuber) = E ψ'
  double second = 0.0;                                     // E ψ²
  double freedom = 0.0;                                    // of the scale, for each member

  HuberMoments() {
    const double density = std::exp(-0.5 * kHuber * kHuber) / std::sqrt(2.0 * std::numbers::pi);
    const double tails = 1.0 - inside;
    const double z2 = inside - 2.0 * kHuber * density;                      // E[Z²; |Z| < kHuber]
    const double z4 = 3.0 * z2 - 2.0 * kHuber * kHuber * kHuber * density;  // E[Z⁴; |Z| < kHuber]
    second = z2 + kHuber * kHuber * tails;
    const double fourth = z4 + kHuber * kHuber * kHuber * kHuber * tails;
    const double variance = (fourth - second * second) / (4.0 * z2 * z2);  // of log scale, times n
    freedom = 0.5 / variance;
  }
};

class RobustFit {
 public:
  RobustFit(std::span<const double> values, std::span<const double> errors, std::size_t without) {
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i == without) {
        continue;
      }
      x_.push_back(check::finite(values[i], "value"));
      const double s = check::non_negative(errors[i], "standard error");
      variance_.push_back(s * s);
    }
    check::that(x_.size() >= 2, "values", "at least two");
    const auto [low, high] = std::minmax_element(x_.begin(), x_.end());
    range_ = *high - *low;
    const double size = std::max(std::abs(*low), std::abs(*high));
    floor_ = std::max(1e-24 * size * size, std::numeric_limits<double>::min());
    centre_ = core::median(x_);
  }

  RandomEffects solve() {
    const double n = static_cast<double>(x_.size());
    const double wanted = (n - 1.0) / n * moments_.second;
    double low = 0.0, high = range_ / std::sqrt(wanted);
    if (excess(0.0, wanted) <= 0.0) {
      high = 0.0;
    }
    for (int k = 0; k < 60 && high - low > 1e-7 * high; ++k) {
      const double middle = 0.5 * (low + high);
      (excess(middle, wanted) > 0.0 ? low : high) = middle;
    }
    const double tau = 0.5 * (low + high);
    (void)excess(tau, wanted);
    double weight = 0.0;
    for (const double v : variance_) {
      weight += 1.0 / (v + tau * tau + floor_);
    }
    return {.members = x_.size(),
            .centre = centre_,
            .centre_error = std::sqrt(moments_.second / weight) / moments_.inside,
            .spread = tau,
            .freedom = moments_.freedom * (n - 1.0)};
  }

 private:
  // Mean ψ² − wanted at the spread `tau`, with the centre that belongs to it: reweighted means from the last one.
  double excess(double tau, double wanted) {
    const double between = tau * tau + floor_;
    for (int k = 0; k < 50; ++k) {
      double sum = 0.0, weight = 0.0;
      for (std::size_t i = 0; i < x_.size(); ++i) {
        const double v = variance_[i] + between;
        const double d = std::abs(x_[i] - centre_);
        const double w = (d * d <= kHuber * kHuber * v ? 1.0 : kHuber * std::sqrt(v) / d) / v;
        sum += w * (x_[i] - centre_);
        weight += w;
      }
      const double step = sum / weight;
      centre_ += step;
      if (step * step * weight < 1e-16) {
        break;
      }
    }
    double total = 0.0;
    for (std::size_t i = 0; i < x_.size(); ++i) {
      const double d = x_[i] - centre_;
      total += std::min(d * d / (variance_[i] + between), kHuber * kHuber);
    }
    return total / static_cast<double>(x_.size()) - wanted;
  }

  HuberMoments moments_;
  std::vector<double> x_, variance_;
  double range_ = 0.0, floor_ = 0.0, centre_ = 0.0;
};

}  // namespace

RandomEffects fit_random_effects(std::span<const double> values, std::span<const double> errors, std::size_t without) {
  check::that(values.size() == errors.size(), "errors", "as many as values");
  return RobustFit(values, errors, without).solve();
}

namespace {

constexpr std::size_t most_left_out = 200;

// Values from the (1 − share)/2 quantile of the lower bounds to the other one of the upper bounds, taken outward.
Interval central_range(const FleetColumn& column, double share) {
  std::vector<double> lower, upper;
  for (const FleetEntry& e : column.entries) {
    lower.push_back(e.lower);
    upper.push_back(e.upper);
  }
  const auto cut = static_cast<std::size_t>(0.5 * (1.0 - share) * static_cast<double>(lower.size()));
  const std::size_t last = upper.size() - 1;
  return {core::order_statistic(std::move(lower), cut), core::order_statistic(std::move(upper), last - cut)};
}

// Share of the robots that are not outside which are certainly below, or certainly above, whichever is larger.
double certainly_beyond(const FleetColumn& column, const FleetEntry& robot, const std::set<std::size_t>& strangers) {
  std::size_t below = 0, above = 0, all = 0;
  for (const FleetEntry& e : column.entries) {
    if (!strangers.contains(e.robot)) {
      ++all;
      below += e.upper < robot.lower ? 1 : 0;
      above += e.lower > robot.upper ? 1 : 0;
    }
  }
  return all == 0 ? 0.0 : static_cast<double>(std::max(below, above)) / static_cast<double>(all);
}

double two_sided(double t, double freedom) { return 2.0 * core::student_tail(freedom, std::abs(t)); }

struct Shown {
  std::vector<const FleetEntry*> entries;
  std::vector<double> values, errors;
};

Shown shown_of(const FleetColumn& column) {
  Shown shown;
  for (const FleetEntry& e : column.entries) {
    if (std::isfinite(e.estimate) && e.standard_error >= 0.0 && std::isfinite(e.standard_error)) {
      shown.entries.push_back(&e);
      shown.values.push_back(e.estimate);
      shown.errors.push_back(e.standard_error);
    }
  }
  return shown;
}

}  // namespace

Population describe_population(const FleetTable& table, const PopulationOptions& options) {
  check::that(options.level > 0.0 && options.level < 1.0, "level", "in (0, 1)");
  check::that(options.central > 0.0 && options.central < 1.0, "central", "in (0, 1)");
  check::that(options.odd_level > 0.0 && options.odd_level < 1.0, "odd_level", "in (0, 1)");
  check::that(options.fewest >= 4, "fewest", "at least 4");
  Population population;
  std::vector<RobotOutside> candidates;
  std::vector<std::size_t> which;  // index of each candidate in p
  std::vector<double> p;
  for (std::size_t j = 0; j < table.columns.size(); ++j) {
    const FleetColumn& column = table.columns[j];
    const Shown shown = shown_of(column);
    ParameterPopulation& parameter = population.parameters.emplace_back();
    parameter.column = j;
    parameter.shown = shown.entries.size();
    parameter.described = parameter.shown >= options.fewest;
    if (!parameter.described) {
      continue;
    }
    parameter.fit = fit_random_effects(shown.values, shown.errors);
    parameter.typical_error = core::median(shown.errors);
    parameter.central = central_range(column, options.central);
    for (std::size_t i = 0; i < shown.entries.size(); ++i) {
      const RandomEffects others =
          shown.entries.size() <= most_left_out ? fit_random_effects(shown.values, shown.errors, i) : parameter.fit;
      const double s = shown.errors[i];
      const double sd = std::sqrt(s * s + others.spread * others.spread + others.centre_error * others.centre_error);
      const double t = sd > 0.0 ? (shown.values[i] - others.centre) / sd : 0.0;
      const double own = sd > 0.0 ? s * s / (sd * sd) : 0.0;
      p.push_back(two_sided(t, 1.0 / (1.0 / others.freedom + own * own / shown.entries[i]->freedom)));
      if (p.back() <= std::max(options.level, options.odd_level)) {
        which.push_back(p.size() - 1);
        candidates.push_back(
            {.robot = shown.entries[i]->robot, .column = j, .value = shown.values[i], .deviations = t, .p = p.back()});
      }
    }
  }
  population.tests = p.size();
  const std::vector<double> adjusted = core::holm(p);
  std::map<std::size_t, std::set<std::size_t>> strangers;  // of each column
  for (std::size_t k = 0; k < candidates.size(); ++k) {
    candidates[k].adjusted_p = adjusted[which[k]];
    if (candidates[k].adjusted_p > options.level) {
      if (candidates[k].adjusted_p <= options.odd_level) {
        population.odd.push_back(candidates[k]);
      }
      continue;
    }
    population.outside.push_back(candidates[k]);
    strangers[candidates[k].column].insert(candidates[k].robot);
  }
  for (std::vector<RobotOutside>* const list : {&population.outside, &population.odd}) {
    for (RobotOutside& robot : *list) {
      const FleetColumn& column = table.columns[robot.column];
      const auto entry = std::lower_bound(column.entries.begin(), column.entries.end(), robot.robot,
                                          [](const FleetEntry& e, std::size_t number) { return e.robot < number; });
      robot.certainly_beyond = certainly_beyond(column, *entry, strangers[robot.column]);
      robot.certain = robot.certainly_beyond >= 0.5 * (1.0 + options.central);
    }
    std::stable_sort(list->begin(), list->end(), [](const auto& a, const auto& b) {
      return a.adjusted_p != b.adjusted_p ? a.adjusted_p < b.adjusted_p
                                          : std::abs(a.deviations) > std::abs(b.deviations);
    });
  }
  return population;
}

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

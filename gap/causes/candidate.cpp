// SPDX-License-Identifier: Apache-2.0
#include "gap/causes/candidate.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <random>
#include <utility>

#include "core/check.hpp"
#include "core/for_all.hpp"

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

  // Three causes of which one takes any form fit nearly anything.
  [[nodiscard]] bool crowded(const Members& members, std::size_t effect) const {
    return members.size() >= 2 && !table_.free_form.empty() &&
           (table_.free_form[effect] ||
            std::ranges::any_of(members, [&](std::size_t c) { return table_.free_form[table_.candidates[c].effect]; }));
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
        const bool there = std::any_of(level[i].members.begin(), level[i].members.end(), [&](std::size_t c) {
          return table_.names[table_.candidates[c].effect] == table_.names[e];
        });
        if (!there && !crowded(level[i].members, e)) {
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
    numbers += table.candidates[c].shape.size() - table.candidates[c].beside;
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

namespace {

// A sum of columns, weight by column.
using Contribution = std::vector<std::pair<std::size_t, double>>;

double overlap(const BlockGram& gram, const Contribution& a, const Contribution& b) {
  double sum = 0.0;
  for (const auto& [i, weight_i] : a) {
    for (const auto& [j, weight_j] : b) {
      sum += weight_i * weight_j * gram.product(i, j);
    }
  }
  return sum;
}

// A contribution by columns that have other ones.
struct Imitation {
  Eigen::VectorXd coefficients;
  double left = 0.0;  // Σ² of what they do not make up
};

// `a` by the columns `on` with coefficients of these signs.
Imitation imitation(const BlockGram& gram, const Contribution& a, const std::vector<std::size_t>& on,
                    const std::vector<int>& sign) {
  const auto n = static_cast<Eigen::Index>(on.size());
  Eigen::VectorXd unit(n), b(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t c = on[static_cast<std::size_t>(i)];
    unit[i] = 1.0 / std::sqrt(std::max(gram.square(c), std::numeric_limits<double>::min()));
    b[i] = unit[i] * overlap(gram, {{c, 1.0}}, a);
  }
  Eigen::MatrixXd A(n, n);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j <= i; ++j) {
      A(i, j) = A(j, i) =
          unit[i] * unit[j] * gram.product(on[static_cast<std::size_t>(i)], on[static_cast<std::size_t>(j)]);
    }
  }
  const Eigen::VectorXd x = signed_least_squares(A, b, sign).x;
  return {unit.cwiseProduct(x), std::max(overlap(gram, a, a) + x.dot(A * x) - 2.0 * x.dot(b), 0.0)};
}

// Columns of θ and of a set, with the signs that their coefficients may have.
struct SignedColumns {
  std::vector<std::size_t> on;
  std::vector<int> sign;
};

SignedColumns columns_beside_theta(const CandidateTable& table, const std::vector<std::size_t>& set, BaseModel base) {
  SignedColumns columns{base == BaseModel::refitted ? table.base : table.unknown, {}};
  columns.sign.assign(columns.on.size(), 0);
  for (const std::size_t c : set) {
    const Candidate& member = table.candidates[c];
    columns.on.insert(columns.on.end(), member.columns.begin(), member.columns.end());
    for (std::size_t k = 0; k < member.columns.size(); ++k) {
      columns.sign.push_back(member.unit_coefficient ? 0 : member.sign[k]);
    }
  }
  return columns;
}

}  // namespace

double unexplained_by(const CandidateTable& table, const std::vector<std::size_t>& a, const std::vector<std::size_t>& b,
                      BaseModel base) {
  const std::vector<std::size_t>& theta = base == BaseModel::refitted ? table.base : table.unknown;
  const auto [on, sign] = columns_beside_theta(table, b, base);
  std::vector<int> opposite = sign;
  std::ranges::transform(opposite, opposite.begin(), std::negate<>());
  double share = 0.0;
  for (const std::size_t c : a) {
    const Candidate& member = table.candidates[c];
    for (std::size_t k = 0; k < member.columns.size(); ++k) {
      const Contribution column{{member.columns[k], 1.0}};
      const double alone = imitation(*table.gram, column, theta, {}).left;
      // What θ takes up is no column beside it.
      if (!(alone > 1e-6 * table.gram->square(member.columns[k]))) {
        continue;
      }
      const int way = member.unit_coefficient ? 1 : member.sign[k];
      const double up = way < 0 ? 0.0 : imitation(*table.gram, column, on, sign).left;
      const double down = way > 0 ? 0.0 : imitation(*table.gram, column, on, opposite).left;
      share = std::max(share, std::clamp(std::max(up, down) / alone, 0.0, 1.0));
    }
  }
  return share;
}

double fit_unexplained_by(const CandidateTable& table, const std::vector<std::size_t>& a,
                          const std::vector<std::size_t>& b, BaseModel base) {
  const std::vector<std::size_t>& theta = base == BaseModel::refitted ? table.base : table.unknown;
  const auto [on, sign] = columns_beside_theta(table, b, base);
  const Subset subset = subset_of(table, a, base);
  Contribution response{{table.gram->columns(), 1.0}};
  for (const std::size_t fixed : subset.fixed) {
    response.emplace_back(fixed, -1.0);
  }
  const Eigen::VectorXd coefficients = imitation(*table.gram, response, subset.columns, subset.sign).coefficients;
  auto next = static_cast<Eigen::Index>(theta.size());
  double share = 0.0;
  for (const std::size_t c : a) {
    const Candidate& member = table.candidates[c];
    Contribution own;
    for (const std::size_t column : member.columns) {
      own.emplace_back(column, member.unit_coefficient ? 1.0 : coefficients[next++]);
    }
    const double alone = imitation(*table.gram, own, theta, {}).left;
    if (alone > 1e-6 * overlap(*table.gram, own, own)) {
      share = std::max(share, std::clamp(imitation(*table.gram, own, on, sign).left / alone, 0.0, 1.0));
    }
  }
  return share;
}

std::vector<double> shapley_shares(const CandidateTable& table, const CauseSet& set, BaseModel base, double gap) {
  const std::size_t k = set.members.size();
  std::vector<double> error(std::size_t{1} << k);
  for (std::size_t mask = 0; mask < error.size(); ++mask) {
    std::vector<std::size_t> members;
    for (std::size_t i = 0; i < k; ++i) {
      if ((mask >> i & 1U) != 0U) {
        members.push_back(set.members[i]);
      }
    }
    error[mask] = evaluate(table, std::move(members), base).held_out_error;
  }
  std::vector<double> shares(k, 0.0);
  for (std::size_t i = 0; i < k; ++i) {
    for (std::size_t mask = 0; mask < error.size(); ++mask) {
      if ((mask >> i & 1U) != 0U) {
        continue;
      }
      const auto before = static_cast<double>(std::popcount(mask));
      const auto all = static_cast<double>(k);
      // before! (k − before − 1)! / k!
      const double weight = std::exp(std::lgamma(before + 1.0) + std::lgamma(all - before) - std::lgamma(all + 1.0));
      shares[i] += weight * (error[mask] - error[mask | std::size_t{1} << i]) / std::max(gap, 1e-300);
    }
  }
  return shares;
}

std::vector<std::vector<CauseSet>> search_causes(const CandidateTable& table, const CauseSearchOptions& options) {
  return Search(table, options).run();
}

namespace {

// Standardised sums over a regime for any arrangement of the blocks of values over those of the regime.
struct Arrangement {
  Eigen::MatrixXd product;  // (block of the regime, block of values)
  double mean = 0.0, deviation = 0.0;

  [[nodiscard]] double score(const std::vector<Eigen::Index>& order) const {
    double sum = 0.0;
    for (std::size_t i = 0; i < order.size(); ++i) {
      sum += product(order[i], static_cast<Eigen::Index>(i));
    }
    return (sum - mean) / deviation;
  }
};

// Mean and deviation over all arrangements (Hoeffding 1951).
Arrangement arrangement(const Mask& regime, const Eigen::MatrixXd& blocks) {
  const Eigen::Index length = blocks.rows(), n = blocks.cols();
  const Eigen::MatrixXd in = regime.head(length * n).cast<double>().matrix().reshaped(length, n);
  Arrangement a;
  a.product.noalias() = in.transpose() * blocks;
  a.mean = a.product.sum() / static_cast<double>(n);
  Eigen::MatrixXd rest = a.product;
  rest.colwise() -= a.product.rowwise().mean();
  rest.rowwise() -= a.product.colwise().mean();
  rest.array() += a.product.mean();
  a.deviation = std::sqrt(rest.squaredNorm() / static_cast<double>(n - 1));
  return a;
}

}  // namespace

double memory_of_squares(const Eigen::VectorXd& series) {
  const Eigen::VectorXd centred = series.array() - series.mean();
  const double variance = centred.squaredNorm();
  double sum = 1.0;
  const Eigen::Index n = series.size();
  for (Eigen::Index lag = 1; lag < n / 4 && variance > 0.0; ++lag) {
    const double rho = centred.head(n - lag).dot(centred.tail(n - lag)) / variance;
    if (std::abs(rho) <= 0.2) {
      break;
    }
    sum += 2.0 * rho * rho;
  }
  return sum;
}

std::vector<double> block_permutation_p_values(const Eigen::VectorXd& values, const std::vector<Mask>& regimes,
                                               double memory, std::size_t permutations, std::uint64_t seed) {
  std::vector<double> p(regimes.size(), 1.0);
  if (values.size() < 64) {
    return p;
  }
  const auto blocks =
      std::clamp<Eigen::Index>(static_cast<Eigen::Index>(static_cast<double>(values.size()) / (10.0 * memory)), 12, 48);
  const Eigen::Index length = values.size() / blocks;
  const Eigen::MatrixXd cut =
      (values.head(length * blocks).array() - values.head(length * blocks).mean()).matrix().reshaped(length, blocks);
  std::vector<Eigen::Index> order(static_cast<std::size_t>(blocks));
  std::iota(order.begin(), order.end(), Eigen::Index{0});

  std::vector<Arrangement> tested;
  std::vector<std::size_t> index;
  const double scale = std::sqrt(cut.squaredNorm());
  for (std::size_t r = 0; r < regimes.size(); ++r) {
    Arrangement a = arrangement(regimes[r], cut);
    if (a.deviation > 1e-9 * scale) {
      tested.push_back(std::move(a));
      index.push_back(r);
    }
  }
  std::vector<double> observed;
  for (const Arrangement& a : tested) {
    observed.push_back(a.score(order));
  }
  std::vector<std::size_t> rank(tested.size());
  std::iota(rank.begin(), rank.end(), std::size_t{0});
  std::sort(rank.begin(), rank.end(), [&](std::size_t a, std::size_t b) { return observed[a] > observed[b]; });

  std::vector<std::size_t> above(tested.size(), 1);
  std::mt19937_64 generator(seed);
  for (std::size_t k = 0; k < permutations; ++k) {
    std::shuffle(order.begin(), order.end(), generator);
    double largest = -1e300;
    for (std::size_t i = rank.size(); i-- > 0;) {
      largest = std::max(largest, tested[rank[i]].score(order));
      above[i] += largest >= observed[rank[i]] ? 1 : 0;
    }
  }
  double running = 0.0;
  for (std::size_t i = 0; i < rank.size(); ++i) {
    running = std::max(running, static_cast<double>(above[i]) / static_cast<double>(permutations + 1));
    p[index[rank[i]]] = running;
  }
  return p;
}

namespace {

// Standard error of the mean of `d`; the smallest positive number where it does not vary.
double standard_error(const Eigen::VectorXd& d) {
  const auto n = static_cast<double>(d.size());
  const double variance = (d.array() - d.mean()).square().sum() / (n - 1.0);
  return std::max(std::sqrt(variance / n), std::numeric_limits<double>::min());
}

}  // namespace

std::vector<double> model_confidence_set(const std::vector<Eigen::VectorXd>& losses,
                                         const ConfidenceSetOptions& options) {
  check::that(!losses.empty() && losses.front().size() >= 4, "losses", "at least one model and four blocks");
  check::that(options.resamples > 0, "ConfidenceSetOptions::resamples", "> 0");
  const Eigen::Index blocks = losses.front().size();
  for (const Eigen::VectorXd& loss : losses) {
    check::that(loss.size() == blocks && loss.allFinite(), "losses", "one finite value per block");
  }
  std::size_t best = 0;
  for (std::size_t i = 1; i < losses.size(); ++i) {
    if (losses[i].sum() < losses[best].sum()) {
      best = i;
    }
  }
  std::vector<double> t(losses.size());
  std::vector<std::size_t> order{best};  // the best, then the others, the one to be dropped last first
  for (std::size_t i = 0; i < losses.size(); ++i) {
    if (i != best) {
      t[i] = ((losses[i] - losses[best]).mean() - options.margin) / standard_error(losses[i] - losses[best]);
      order.push_back(i);
    }
  }
  std::stable_sort(order.begin() + 1, order.end(), [&t](std::size_t a, std::size_t b) { return t[a] < t[b]; });
  const auto models = static_cast<Eigen::Index>(order.size());
  Eigen::MatrixXd centred(blocks, models), error(models, models);
  for (Eigen::Index i = 0; i < models; ++i) {
    const Eigen::VectorXd& loss = losses[order[static_cast<std::size_t>(i)]];
    centred.col(i) = loss.array() - loss.mean();
    for (Eigen::Index j = 0; j < i; ++j) {
      error(i, j) = error(j, i) = standard_error(centred.col(i) - centred.col(j));
    }
  }

  // How often the largest studentised mean among the first k + 1 models, beyond that of the best of them, is at least
  // t_k where all are equally good: which one comes out best is left to chance too.
  std::vector<std::size_t> beyond(order.size(), 0);
  std::mt19937_64 generator(options.seed);
  std::uniform_int_distribution<Eigen::Index> any(0, blocks - 1);
  Eigen::VectorXd weight(blocks);
  for (std::size_t r = 0; r < options.resamples; ++r) {
    weight.setZero();
    for (Eigen::Index b = 0; b < blocks; ++b) {
      weight[any(generator)] += 1.0;
    }
    const Eigen::VectorXd mean = centred.transpose() * weight / static_cast<double>(blocks);
    Eigen::Index lowest = 0;
    double largest = 0.0;
    for (Eigen::Index k = 1; k < models; ++k) {
      if (mean[k] < mean[lowest]) {
        lowest = k;
        largest = 0.0;
        for (Eigen::Index i = 0; i < k; ++i) {
          largest = std::max(largest, (mean[i] - mean[k]) / error(i, k));
        }
      } else {
        largest = std::max(largest, (mean[k] - mean[lowest]) / error(k, lowest));
      }
      beyond[static_cast<std::size_t>(k)] += largest >= t[order[static_cast<std::size_t>(k)]] ? 1 : 0;
    }
  }
  std::vector<double> p(losses.size(), 1.0);
  double so_far = 0.0;
  for (std::size_t k = order.size() - 1; k > 0; --k) {
    so_far = std::max(so_far, (1.0 + static_cast<double>(beyond[k])) / (1.0 + static_cast<double>(options.resamples)));
    p[order[k]] = so_far;
  }
  return p;
}

}  // namespace wheelwright::gap

// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/selection.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <Eigen/Cholesky>
#include <boost/math/distributions/normal.hpp>

#include <wheelwright/core/check.hpp>
#include <wheelwright/gap/confidence_set.hpp>

namespace wheelwright {
namespace {

// Wilcoxon's signed-rank statistic of what `better` saves against `worse` over blocks, in standard deviations. An effect
// may show in a few blocks only, by amounts that differ a thousandfold: the mean's t would be blind to it.
double signed_rank(const CauseSet& worse, const CauseSet& better) {
  const Eigen::VectorXd d = worse.loss - better.loss;
  std::vector<Eigen::Index> order(static_cast<std::size_t>(d.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](Eigen::Index a, Eigen::Index b) { return std::abs(d[a]) < std::abs(d[b]); });
  double positive = 0.0;
  for (std::size_t k = 0; k < order.size(); ++k) {
    positive += d[order[k]] > 0.0 ? static_cast<double>(k + 1) : 0.0;
  }
  const auto n = static_cast<double>(d.size());
  return (positive - n * (n + 1.0) / 4.0) / std::sqrt(n * (n + 1.0) * (2.0 * n + 1.0) / 24.0);
}

// The same where every one of `blocks` blocks is better.
double largest_signed_rank(double blocks) { return std::sqrt(1.5 * blocks * (blocks + 1.0) / (2.0 * blocks + 1.0)); }

// What the columns `on` leave of the products of the columns `of`.
Eigen::MatrixXd remainder(const BlockGram& gram, const std::vector<std::size_t>& of,
                          const std::vector<std::size_t>& on) {
  const auto n = static_cast<Eigen::Index>(of.size());
  const auto k = static_cast<Eigen::Index>(on.size());
  const auto products = [&gram](const std::vector<std::size_t>& a, const std::vector<std::size_t>& b) {
    Eigen::MatrixXd m(static_cast<Eigen::Index>(a.size()), static_cast<Eigen::Index>(b.size()));
    for (Eigen::Index i = 0; i < m.rows(); ++i) {
      for (Eigen::Index j = 0; j < m.cols(); ++j) {
        m(i, j) = gram.product(a[static_cast<std::size_t>(i)], b[static_cast<std::size_t>(j)]);
      }
    }
    return m;
  };
  Eigen::MatrixXd rest = products(of, of);
  if (n > 0 && k > 0) {
    Eigen::MatrixXd A = products(on, on);
    const Eigen::VectorXd unit = A.diagonal().cwiseMax(std::numeric_limits<double>::min()).cwiseSqrt().cwiseInverse();
    A = unit.asDiagonal() * A * unit.asDiagonal();
    A.diagonal().array() += 1e-10;
    const Eigen::MatrixXd c = unit.asDiagonal() * products(on, of);
    rest -= c.transpose() * A.ldlt().solve(c);
  }
  return rest;
}

// Largest share of a column of candidate `c` that θ cannot make up.
double beyond_theta(const CandidateTable& table, std::size_t c) {
  const std::vector<std::size_t>& columns = table.candidates[c].columns;
  const Eigen::MatrixXd rest = remainder(*table.gram, columns, table.base);
  double share = 0.0;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    const double square = table.gram->square(columns[k]);
    if (square > 0.0) {
      share = std::max(share, rest(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k)) / square);
    }
  }
  return share;
}

class Selector {
 public:
  Selector(const CandidateTable& table, const std::vector<EffectKind>& kinds, double floor_error,
           const SelectionOptions& options)
      : table_(table), kinds_(kinds), floor_(floor_error), options_(options) {
    const auto tried = static_cast<double>(std::max<std::size_t>(kinds.size(), 1));
    critical_ = boost::math::quantile(boost::math::complement(boost::math::normal(), options.significance / tried));
    moves_theta_only_.assign(kinds.size(), true);
    for (std::size_t c = 0; c < table.candidates.size(); ++c) {
      if (beyond_theta(table, c) > options.contained) {
        moves_theta_only_[table.candidates[c].effect] = false;
      }
    }
  }

  [[nodiscard]] Selection run(bool nominal_trusted) {
    Selection result;
    CauseSearchOptions search;
    search.threads = options_.threads;
    search.allowed.resize(kinds_.size());
    for (std::size_t e = 0; e < kinds_.size(); ++e) {
      search.allowed[e] = !moves_theta_only_[e];
    }
    const std::vector<std::vector<CauseSet>> levels = search_causes(table_, search);
    const CauseSet& nothing = levels[0][0];
    const auto used = static_cast<double>((table_.gram->rows().array() > 0.0).count());
    result.enough_blocks = largest_signed_rank(used) > critical_;
    const CauseSet nominal = nominal_trusted ? evaluate(table_, {}, BaseModel::nominal) : nothing;
    result.refitted_excess = nothing.held_out_error - floor_;
    result.nominal_excess = nominal.held_out_error - floor_;
    gap_ = std::max({result.refitted_excess, result.nominal_excess, 0.0});

    CauseSet best = nothing;
    for (std::size_t size = 1; size < levels.size(); ++size) {
      if (levels[size].empty()) {
        continue;
      }
      const CauseSet& next = simplest(levels[size]);
      if (gains(best, next, result.refitted_excess)) {
        best = all_needed(next, result.refitted_excess);
      }
    }
    result.structural = best;
    result.left = best.held_out_error - floor_;
    for (const std::vector<CauseSet>& level : levels) {
      result.looked_at.insert(result.looked_at.end(), level.begin(), level.end());
    }
    std::vector<CauseSet> rivals;
    if (!best.members.empty()) {
      rivals = rivals_of(best, levels[best.members.size()]);
    }
    add_parametric(result, rivals, nominal_trusted);
    result.any_cause = !result.all.members.empty() || result.theta_moved;
    result.reaches_floor =
        result.left <= std::max({options_.tolerated * result.refitted_excess,
                                 std::min(options_.tolerated_nominal * gap_, 4.0 * options_.tolerated_floor),
                                 options_.tolerated_floor});
    return result;
  }

 private:
  [[nodiscard]] double excess(const CauseSet& set) const { return std::max(set.held_out_error - floor_, 0.0); }

  // Whether `next` is worth its further causes. Nothing is where the floor is reached already.
  [[nodiscard]] bool gains(const CauseSet& now, const CauseSet& next, double whole) const {
    const double gain = now.held_out_error - next.held_out_error;
    const double left = excess(now);
    if (!(left > 0.0)) {
      return false;
    }
    const bool counts = gain > options_.share * whole && gain > options_.part * left;
    const bool large = gain > options_.large_share * whole;
    const bool last =
        gain > options_.large_part * left && gain > options_.tolerated_floor && gain > options_.small_share * whole;
    return gain > options_.smallest && (counts || large || last) && signed_rank(now, next) > critical_;
  }

  // The set without those of its members that it does as well without.
  [[nodiscard]] CauseSet all_needed(CauseSet set, double whole) const {
    for (std::size_t k = 0; k < set.members.size() && set.members.size() > 1;) {
      std::vector<std::size_t> others = set.members;
      others.erase(others.begin() + static_cast<std::ptrdiff_t>(k));
      CauseSet without = evaluate(table_, std::move(others), BaseModel::refitted);
      if (gains(without, set, whole)) {
        ++k;
      } else {
        set = std::move(without);
        k = 0;
      }
    }
    return set;
  }

  // How much worse than `best` a set may be and still be as good.
  [[nodiscard]] double margin(const CauseSet& best) const {
    return std::max(options_.misfit * excess(best), 0.3 * options_.smallest);
  }

  // Whether the causes of the set undo each other.
  [[nodiscard]] bool cancels(const CauseSet& set) const {
    if (set.members.size() < 2) {
      return false;
    }
    const Subset subset = subset_of(table_, set.members, BaseModel::refitted);
    const Eigen::VectorXd coefficients = table_.gram->fit(subset).coefficients;
    // Columns of all members with their weights, member by member.
    std::vector<std::vector<std::pair<std::size_t, double>>> parts;
    auto next = static_cast<Eigen::Index>(table_.base.size());
    for (const std::size_t c : set.members) {
      const Candidate& candidate = table_.candidates[c];
      std::vector<std::pair<std::size_t, double>> part;
      for (const std::size_t column : candidate.columns) {
        part.emplace_back(column, candidate.unit_coefficient ? 1.0 : coefficients[next++]);
      }
      parts.push_back(std::move(part));
    }
    double own = 0.0, together = 0.0;
    for (std::size_t i = 0; i < parts.size(); ++i) {
      for (std::size_t j = 0; j < parts.size(); ++j) {
        double product = 0.0;
        for (const auto& [a, weight_a] : parts[i]) {
          for (const auto& [b, weight_b] : parts[j]) {
            product += weight_a * weight_b * table_.gram->product(a, b);
          }
        }
        together += product;
        own += i == j ? product : 0.0;
      }
    }
    return own > options_.cancellation * together;
  }

  // The set of a level to go on with: the best, or one it contains that is as good with fewer coefficients.
  [[nodiscard]] const CauseSet& simplest(const std::vector<CauseSet>& level) const {
    const auto first = std::find_if(level.begin(), level.end(), [this](const CauseSet& set) { return !cancels(set); });
    const CauseSet* chosen = first == level.end() ? &level.front() : &*first;
    for (const CauseSet& set : level) {
      if (cancels(set)) {
        continue;
      }
      if (set.coefficients < chosen->coefficients &&
          set.held_out_error <= level.front().held_out_error + margin(level.front()) &&
          unexplained_by(table_, set.members, level.front().members, BaseModel::refitted) < options_.contained) {
        chosen = &set;
      }
    }
    return *chosen;
  }

  // Sets of as many causes that are as good as `best`, itself first. A set that merely contains another one is left out.
  [[nodiscard]] std::vector<CauseSet> rivals_of(const CauseSet& best, const std::vector<CauseSet>& level) const {
    std::vector<CauseSet> rivals{best};
    for (const CauseSet& set : level) {
      const bool itself = set.members == best.members;
      const bool close = !cancels(set) && set.held_out_error <= best.held_out_error + 3.0 * margin(best) + 0.005 * gap_;
      if (itself || !close) {
        continue;
      }
      const bool contains = std::any_of(rivals.begin(), rivals.end(), [&](const CauseSet& other) {
        return other.coefficients < set.coefficients &&
               unexplained_by(table_, other.members, set.members, BaseModel::refitted) < options_.contained;
      });
      if (!contains) {
        rivals.push_back(set);
      }
    }
    return rivals;
  }

  // The set with θ nominal, its members' shapes chosen again among those that are as good with θ fitted: a friction more on
  // the right and less on the left are the same thing beside a free θ.
  [[nodiscard]] CauseSet with_shapes_for_nominal(const CauseSet& set) const {
    CauseSet best = evaluate(table_, set.members, BaseModel::nominal);
    for (std::size_t k = 0; k < set.members.size(); ++k) {
      for (std::size_t c = 0; c < table_.candidates.size(); ++c) {
        if (table_.candidates[c].effect != table_.candidates[set.members[k]].effect || c == best.members[k]) {
          continue;
        }
        std::vector<std::size_t> members = best.members;
        members[k] = c;
        if (evaluate(table_, members, BaseModel::refitted).held_out_error > set.held_out_error + margin(set)) {
          continue;
        }
        CauseSet other = evaluate(table_, members, BaseModel::nominal);
        if (other.held_out_error < best.held_out_error) {
          best = std::move(other);
        }
      }
    }
    return best;
  }

  // Parametric causes that let `structural` do with θ nominal as well as with θ fitted: sets of one or two, best first;
  // an empty one where none is needed. Nothing where no such set does.
  [[nodiscard]] std::vector<CauseSet> explain_theta(const CauseSet& structural) const {
    const CauseSet held = with_shapes_for_nominal(structural);
    const double tolerable = std::max(options_.theta_share * gap_, options_.smallest);
    if (excess(held) - excess(structural) <= tolerable) {
      return {held};
    }
    std::vector<std::size_t> movers;
    for (std::size_t c = 0; c < table_.candidates.size(); ++c) {
      if (moves_theta_only_[table_.candidates[c].effect]) {
        movers.push_back(c);
      }
    }
    for (std::size_t count = 1; count <= 2; ++count) {
      std::vector<CauseSet> found;
      const auto try_set = [&](std::vector<std::size_t> members) {
        members.insert(members.end(), held.members.begin(), held.members.end());
        std::sort(members.begin(), members.end());
        CauseSet set = evaluate(table_, std::move(members), BaseModel::nominal);
        if (excess(set) - excess(structural) <= tolerable) {
          found.push_back(std::move(set));
        }
      };
      for (std::size_t i = 0; i < movers.size(); ++i) {
        if (count == 1) {
          try_set({movers[i]});
          continue;
        }
        for (std::size_t j = i + 1; j < movers.size(); ++j) {
          if (table_.candidates[movers[i]].effect != table_.candidates[movers[j]].effect) {
            try_set({movers[i], movers[j]});
          }
        }
      }
      if (!found.empty()) {
        std::stable_sort(found.begin(), found.end(),
                         [](const CauseSet& a, const CauseSet& b) { return a.held_out_error < b.held_out_error; });
        return found;
      }
    }
    return {};
  }

  void add_parametric(Selection& result, const std::vector<CauseSet>& structural_rivals, bool nominal_trusted) const {
    std::vector<CauseSet> structural = structural_rivals;
    if (structural.empty()) {
      structural.push_back(result.structural);
    }
    result.all = result.structural;
    std::vector<CauseSet> rivals;
    for (std::size_t i = 0; i < structural.size(); ++i) {
      if (!nominal_trusted) {
        rivals.push_back(structural[i]);
        continue;
      }
      const std::vector<CauseSet> found = explain_theta(structural[i]);
      if (i == 0) {
        result.theta_moved = found.empty();
      }
      if (found.empty()) {
        rivals.push_back(structural[i]);
        continue;
      }
      const CauseSet& first = simplest_of(found);
      rivals.push_back(first);
      for (const CauseSet& set : found) {
        const bool close = set.held_out_error <= first.held_out_error + 3.0 * margin(first);
        const bool contains =
            first.coefficients < set.coefficients &&
            unexplained_by(table_, first.members, set.members, BaseModel::nominal) < options_.contained;
        if (set.members != first.members && close && !contains) {
          rivals.push_back(set);
        }
      }
    }
    result.all = rivals.front();
    const bool moves_theta = std::any_of(result.all.members.begin(), result.all.members.end(),
                                         [&](std::size_t c) { return moves_theta_only_[table_.candidates[c].effect]; });
    result.base = moves_theta ? BaseModel::nominal : BaseModel::refitted;
    std::vector<CauseSet> fewest;
    for (const CauseSet& set : rivals) {
      if (set.members.size() <= result.all.members.size()) {
        fewest.push_back(set);
      }
    }
    confide(result, fewest);
  }

  [[nodiscard]] const CauseSet& simplest_of(const std::vector<CauseSet>& sets) const {
    const CauseSet* chosen = &sets.front();
    for (const CauseSet& set : sets) {
      if (set.coefficients < chosen->coefficients &&
          set.held_out_error <= sets.front().held_out_error + margin(sets.front())) {
        chosen = &set;
      }
    }
    return *chosen;
  }

  // The confidence set among `rivals`.
  void confide(Selection& result, const std::vector<CauseSet>& rivals) const {
    if (rivals.empty() || rivals.front().members.empty()) {
      return;
    }
    std::vector<Eigen::VectorXd> losses;
    for (const CauseSet& set : rivals) {
      losses.push_back(set.loss);
    }
    const double rows = table_.gram->rows().mean();
    const std::vector<double> p =
        model_confidence_set(losses, {.margin = margin(rivals.front()) * rows, .seed = options_.seed});
    for (std::size_t i = 0; i < rivals.size(); ++i) {
      if (i == 0 || p[i] >= options_.level) {
        result.credible.push_back({rivals[i], p[i]});
      }
    }
    std::stable_sort(
        result.credible.begin() + 1, result.credible.end(),
        [](const CredibleSet& a, const CredibleSet& b) { return a.set.held_out_error < b.set.held_out_error; });
  }

  const CandidateTable& table_;
  const std::vector<EffectKind>& kinds_;
  double floor_;
  SelectionOptions options_;
  double critical_ = 0.0;
  std::vector<bool> moves_theta_only_;  // by effect: θ fitted again takes all of it
  double gap_ = 0.0;
};

}  // namespace

Selection select_causes(const CandidateTable& table, const std::vector<EffectKind>& kinds, bool nominal_trusted,
                        double floor_error, const SelectionOptions& options) {
  check::that(table.gram != nullptr, "CandidateTable::gram", "set");
  check::that(kinds.size() == table.names.size(), "kinds", "one for each effect");
  return Selector(table, kinds, floor_error, options).run(nominal_trusted);
}

double unexplained_by(const CandidateTable& table, const std::vector<std::size_t>& a, const std::vector<std::size_t>& b,
                      BaseModel base) {
  const auto columns_of = [&](const std::vector<std::size_t>& members) {
    std::vector<std::size_t> columns;
    for (const std::size_t c : members) {
      columns.insert(columns.end(), table.candidates[c].columns.begin(), table.candidates[c].columns.end());
    }
    return columns;
  };
  const std::vector<std::size_t>& theta = base == BaseModel::refitted ? table.base : table.unknown;
  const std::vector<std::size_t> of = columns_of(a);
  std::vector<std::size_t> on = theta;
  for (const std::size_t column : columns_of(b)) {
    on.push_back(column);
  }
  const Eigen::MatrixXd alone = remainder(*table.gram, of, theta);
  const Eigen::MatrixXd beside = remainder(*table.gram, of, on);
  double share = 0.0;
  for (Eigen::Index i = 0; i < alone.rows(); ++i) {
    if (alone(i, i) > 0.0) {
      share = std::max(share, std::clamp(beside(i, i) / alone(i, i), 0.0, 1.0));
    }
  }
  return share;
}

}  // namespace wheelwright

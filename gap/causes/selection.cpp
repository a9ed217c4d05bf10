// SPDX-License-Identifier: Apache-2.0
#include "gap/causes/selection.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <optional>
#include <random>
#include <set>
#include <string>

#include "core/check.hpp"
#include "core/statistics.hpp"
#include "gap/causes/candidate.hpp"
#include "gap/rows/block_gram.hpp"

namespace wheelwright::gap {
namespace {

// Probability that the logarithms of the savings add up to so much when their signs are left to chance: for an effect
// that shows in half of the blocks only, but there by far. By random signs. Below the floor's own mean square savings
// count by their size.
double sign_flip_p(const Eigen::ArrayXd& d, std::uint64_t seed) {
  constexpr int kFlips = 20000;
  const Eigen::ArrayXd size = d.abs().log1p();
  const double seen = (d.sign() * size).sum() * (1.0 - 1e-12);
  std::mt19937_64 generator(seed);
  int as_large = 0;
  for (int k = 0; k < kFlips; ++k) {
    double sum = 0.0;
    std::uint64_t bits = 0;
    for (Eigen::Index i = 0; i < size.size(); ++i) {
      bits = i % 64 == 0 ? generator() : bits >> 1U;
      sum += (bits & 1U) != 0U ? size[i] : -size[i];
    }
    as_large += sum >= seen ? 1 : 0;
  }
  return (1.0 + as_large) / (1.0 + kFlips);
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
    const std::set<std::string> tried_names(table.names.begin(), table.names.end());  // laws of one name are one try
    const auto tried = static_cast<double>(std::max<std::size_t>(tried_names.size(), 1));
    level_ = options.significance / (2.0 * tried);  // two tests of each
    moves_theta_only_.assign(kinds.size(), true);
    does_nothing_.assign(kinds.size(), true);
    for (std::size_t c = 0; c < table.candidates.size(); ++c) {
      const std::size_t effect = table.candidates[c].effect;
      if (beyond_theta(table, c) > options.contained) {
        moves_theta_only_[effect] = false;
      }
      does_nothing_[effect] =
          does_nothing_[effect] && std::ranges::all_of(table.candidates[c].columns, [&](std::size_t column) {
            return !(table.gram->square(column) > 0.0);
          });
    }
    for (std::size_t e = 0; e < kinds.size(); ++e) {
      moves_theta_only_[e] = moves_theta_only_[e] && !does_nothing_[e];
    }
  }

  [[nodiscard]] Selection run(bool nominal_trusted) {
    Selection result;
    CauseSearchOptions search;
    search.threads = options_.threads;
    search.allowed.resize(kinds_.size());
    for (std::size_t e = 0; e < kinds_.size(); ++e) {
      search.allowed[e] = !moves_theta_only_[e] && !does_nothing_[e];
    }
    const std::vector<std::vector<CauseSet>> levels = search_causes(table_, search);
    const CauseSet& refitted = levels[0][0];
    const auto compared = static_cast<double>(table_.spaces == nullptr ? (table_.gram->rows().array() > 0.0).count()
                                                                       : losses(refitted).size());
    result.enough_time = enough_time_ = std::exp2(-compared) < level_;
    const CauseSet nominal = nominal_trusted ? evaluate(table_, {}, BaseModel::nominal) : refitted;
    // A log that does not excite θ tells a worse one than is known: what that leaves, held out, is no gap.
    nominal_is_better_ = nominal.held_out_error < refitted.held_out_error;
    const CauseSet& nothing = nominal_is_better_ ? nominal : refitted;
    result.refitted_excess = nothing.held_out_error - floor_;
    result.nominal_excess = nominal.held_out_error - floor_;
    gap_ = std::max({result.refitted_excess, result.nominal_excess, 0.0});

    CauseSet best = nothing;
    for (std::size_t size = 1; size < levels.size(); ++size) {
      if (levels[size].empty()) {
        continue;
      }
      const CauseSet* next = simplest(levels[size]);
      if (next != nullptr && gains(best, *next, result.refitted_excess)) {
        // Where no member is needed beside the others, what is left may be one that does nothing.
        CauseSet needed = all_needed(*next, result.refitted_excess);
        if (best.held_out_error - needed.held_out_error > 0.5 * (best.held_out_error - next->held_out_error)) {
          best = std::move(needed);
        }
      }
    }
    result.structural = best;
    for (const std::vector<CauseSet>& level : levels) {
      result.looked_at.insert(result.looked_at.end(), level.begin(), level.end());
    }
    std::vector<CauseSet> rivals;
    if (!best.members.empty()) {
      rivals = rivals_of(best, levels[best.members.size()]);
    }
    const bool explanation = add_parametric(result, rivals, nominal_trusted);
    result.left = result.structural.held_out_error - floor_;
    result.any_cause = !result.all.members.empty() || result.theta_moved;
    result.reaches_floor = explanation && tolerable(result);
    return result;
  }

 private:
  [[nodiscard]] double excess(const CauseSet& set) const { return std::max(set.held_out_error - floor_, 0.0); }

  // Whether `next` is worth its further causes. Nothing is where the floor is reached already.
  [[nodiscard]] bool gains(const CauseSet& now, const CauseSet& next, double whole,
                           BaseModel base = BaseModel::refitted) const {
    const double gain = now.held_out_error - next.held_out_error;
    const double left = excess(now);
    if (!(left > 0.0) || gap_ < options_.least_gap) {
      return false;
    }
    const bool counts = gain > options_.share * whole && gain > options_.part * left;
    const bool large = gain > options_.large_share * whole;
    const bool last =
        gain > options_.large_part * left && gain > options_.tolerated_floor && gain > options_.small_share * whole;
    if (!(gain > options_.smallest && (counts || large || last))) {
      return false;
    }
    // Hardly any cause that is not there leaves next to nothing of what it was not fitted to.
    const bool all = excess(next) <= std::max(options_.tolerated * left, options_.tolerated_floor);
    const double level = all && enough_time_ ? options_.significance / 2.0 : level_;
    return saves_more_than_chance(losses(now, base) - losses(next, base), level, options_.seed);
  }

  // What the set, evaluated with `base`, leaves of each stretch of time; with no causes and the nominal θ where that
  // does better.
  [[nodiscard]] Eigen::VectorXd losses(const CauseSet& set, BaseModel base = BaseModel::refitted) const {
    base = nominal_is_better_ && set.members.empty() ? BaseModel::nominal : base;
    return table_.spaces == nullptr
               ? set.loss
               : held_out_pieces(*table_.gram, *table_.spaces, subset_of(table_, set.members, base), options_.piece);
  }

  // The set without those of its members that it does as well without.
  [[nodiscard]] CauseSet all_needed(CauseSet set, double whole) const {
    for (std::size_t k = 0; k < set.members.size() && set.members.size() > 1;) {
      CauseSet without = evaluate_without(table_, set, k, BaseModel::refitted);
      if (gains(without, set, whole)) {
        ++k;
      } else {
        set = std::move(without);
        k = 0;
      }
    }
    return set;
  }

  // What the columns of the set leave at best.
  [[nodiscard]] double inexact(const CauseSet& set) const {
    double sum = 0.0;
    for (std::size_t k = 0; k < set.members.size(); ++k) {
      if (const double share = kinds_[table_.candidates[set.members[k]].effect].inexact; share > 0.0) {
        const double without = evaluate_without(table_, set, k, BaseModel::refitted).held_out_error;
        sum += share * std::max(without - set.held_out_error, 0.0);
      }
    }
    return sum;
  }

  // Whether some member of the set is there for what comes along with it, not for the effect itself.
  [[nodiscard]] bool hollow(const CauseSet& set) const {
    constexpr double kOwn = 0.1;
    for (std::size_t k = 0; k < set.members.size(); ++k) {
      const Candidate& member = table_.candidates[set.members[k]];
      if (member.own.empty() || member.own.size() == member.columns.size()) {
        continue;
      }
      const double without = evaluate_without(table_, set, k, BaseModel::refitted).held_out_error;
      Subset subset = subset_of(table_, set.members, BaseModel::refitted);
      for (std::size_t c = subset.columns.size(); c-- > 0;) {
        if (std::ranges::find(member.own, subset.columns[c]) != member.own.end()) {
          subset.columns.erase(subset.columns.begin() + static_cast<std::ptrdiff_t>(c));
          subset.sign.erase(subset.sign.begin() + static_cast<std::ptrdiff_t>(c));
        }
      }
      const double beside = table_.gram->fit(subset).held_out_error;
      if (beside - set.held_out_error < kOwn * (without - set.held_out_error)) {
        return true;
      }
    }
    return false;
  }

  // Whether the set is no explanation, however little it leaves.
  [[nodiscard]] bool absurd(const CauseSet& set) const { return cancels(set) || hollow(set); }

  // How much worse than `best` a set may be and still be as good.
  [[nodiscard]] double margin(const CauseSet& best) const {
    return std::max(options_.misfit * excess(best), 0.3 * options_.smallest);
  }

  // Whether the set needs an inertia that is none, the causes undo each other, or all of them what they move θ by.
  [[nodiscard]] bool cancels(const CauseSet& set) const {
    if (set.members.empty()) {
      return false;
    }
    const Subset subset = subset_of(table_, set.members, BaseModel::refitted);
    const Eigen::VectorXd coefficients = table_.gram->fit(subset).coefficients;
    for (const auto& [column, nominal] : table_.inertias) {
      const auto at = std::ranges::find(table_.base, column) - table_.base.begin();
      if (at < std::ssize(table_.base) && !(nominal + coefficients[at] > 0.0)) {
        return true;
      }
    }
    // Columns of θ, then of all members, with their weights.
    using Part = std::vector<std::pair<std::size_t, double>>;
    std::vector<Part> parts(1);
    Eigen::Index next = 0;
    for (const std::size_t column : table_.base) {
      parts.front().emplace_back(column, coefficients[next++]);
    }
    for (const std::size_t c : set.members) {
      const Candidate& candidate = table_.candidates[c];
      Part part;
      for (const std::size_t column : candidate.columns) {
        part.emplace_back(column, candidate.unit_coefficient ? 1.0 : coefficients[next++]);
      }
      parts.push_back(std::move(part));
    }
    const auto product = [this](const Part& a, const Part& b) {
      double sum = 0.0;
      for (const auto& [i, weight_i] : a) {
        for (const auto& [j, weight_j] : b) {
          sum += weight_i * weight_j * table_.gram->product(i, j);
        }
      }
      return sum;
    };
    double own = 0.0, causes = 0.0, beside = 0.0;
    for (std::size_t i = 1; i < parts.size(); ++i) {
      own += product(parts[i], parts[i]);
      beside += product(parts[i], parts.front());
      for (std::size_t j = 1; j < parts.size(); ++j) {
        causes += product(parts[i], parts[j]);
      }
    }
    const double theta = product(parts.front(), parts.front());
    const double all = causes + 2.0 * beside + theta;
    return own > options_.cancellation * causes || own + theta > options_.theta_cancellation * all;
  }

  [[nodiscard]] auto numbers_of_the_robot(const CauseSet& set) const {
    return std::ranges::count_if(set.members,
                                 [&](std::size_t c) { return kinds_[table_.candidates[c].effect].parametric; });
  }

  // The set of a level to go on with: the best that is no absurdity, or one that it contains and that is as good with
  // fewer coefficients. Of sets with the same columns the one with the fewest numbers of the robot that may be wrong:
  // somebody has measured these.
  [[nodiscard]] const CauseSet* simplest(const std::vector<CauseSet>& level) const {
    const auto first = std::find_if(level.begin(), level.end(), [this](const CauseSet& set) { return !absurd(set); });
    if (first == level.end()) {
      return nullptr;
    }
    const CauseSet* chosen = &*first;
    for (const CauseSet& set : level) {
      if (set.coefficients < chosen->coefficients &&
          set.held_out_error <= level.front().held_out_error + margin(level.front()) && !absurd(set) &&
          unexplained_by(table_, set.members, level.front().members, BaseModel::refitted) < options_.contained) {
        chosen = &set;
      }
    }
    constexpr double kRounding = 1e-9;
    for (const CauseSet& set : level) {
      if (set.coefficients == chosen->coefficients &&
          std::abs(set.held_out_error - chosen->held_out_error) <= kRounding * chosen->held_out_error &&
          numbers_of_the_robot(set) < numbers_of_the_robot(*chosen) && !absurd(set)) {
        chosen = &set;
      }
    }
    return chosen;
  }

  [[nodiscard]] std::vector<std::string> sorted_names(const CauseSet& set) const {
    std::vector<std::string> names = names_of(table_, set);
    std::ranges::sort(names);
    return names;
  }

  // Sets of as many causes that are as good as `best`, itself first. A set that merely contains another one is left
  // out, unless it is the same causes by other laws: these may say what θ did, too.
  [[nodiscard]] std::vector<CauseSet> rivals_of(const CauseSet& best, const std::vector<CauseSet>& level) const {
    std::vector<CauseSet> rivals{best};
    for (const CauseSet& set : level) {
      const bool itself = set.members == best.members;
      const bool close = set.held_out_error <= best.held_out_error + 3.0 * margin(best) + 0.005 * gap_;
      if (itself || !close || absurd(set)) {
        continue;
      }
      const bool contains = std::any_of(rivals.begin(), rivals.end(), [&](const CauseSet& other) {
        return other.coefficients < set.coefficients && sorted_names(other) != sorted_names(set) &&
               unexplained_by(table_, other.members, set.members, BaseModel::refitted) < options_.contained;
      });
      if (!contains) {
        rivals.push_back(set);
      }
    }
    return rivals;
  }

  // The set with θ nominal, its members' shapes chosen again among those that are as good with θ fitted: a friction
  // more on the right and less on the left are the same thing beside a free θ.
  [[nodiscard]] CauseSet with_shapes_for_nominal(const CauseSet& set) const {
    CauseSet best = evaluate(table_, set.members, BaseModel::nominal);
    for (std::size_t k = 0; k < set.members.size(); ++k) {
      for (std::size_t c = 0; c < table_.candidates.size(); ++c) {
        if (table_.candidates[c].effect != table_.candidates[set.members[k]].effect || c == best.members[k]) {
          continue;
        }
        std::vector<std::size_t> members = best.members;
        members[k] = c;
        if (excess(evaluate(table_, members, BaseModel::refitted)) > excess(set) + margin(set)) {
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

  [[nodiscard]] const std::string& name_of(std::size_t candidate) const {
    return table_.names[table_.candidates[candidate].effect];
  }

  // Whether that many combinations of that many causes do equally well that they are a fit and no explanation.
  [[nodiscard]] bool arbitrary(const std::vector<CredibleSet>& credible) const {
    constexpr std::size_t kCauses = 3, kCombinations = 10;
    std::set<std::vector<std::string>> combinations;
    for (const CredibleSet& member : credible) {
      combinations.insert(sorted_names(member.set));
    }
    return combinations.size() >= kCombinations && credible.front().set.members.size() >= kCauses;
  }

  // Whether a member of `set` is an effect of this candidate's name.
  [[nodiscard]] bool takes_name(const CauseSet& set, std::size_t candidate) const {
    return std::ranges::any_of(set.members, [&](std::size_t c) { return name_of(c) == name_of(candidate); });
  }

  // Parametric causes that let `structural` do with θ nominal as well as with θ fitted: sets of one or two, best first;
  // an empty one where none is needed. Nothing where no such set does.
  [[nodiscard]] std::vector<CauseSet> explain_theta(const CauseSet& structural) const {
    const CauseSet held = with_shapes_for_nominal(structural);
    // What the columns miss, θ may take up.
    const double tolerable =
        std::max(options_.theta_share * gap_ + inexact(structural) + 2.0 * excess(structural), options_.smallest);
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
        if (takes_name(held, movers[i])) {
          continue;
        }
        if (count == 1) {
          try_set({movers[i]});
          continue;
        }
        for (std::size_t j = i + 1; j < movers.size(); ++j) {
          if (name_of(movers[i]) != name_of(movers[j]) && !takes_name(held, movers[j])) {
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

  // `structural` with an effect that stands for one of its members and for what else θ did, where that takes fewer
  // causes than the sets of `found`, or explains θ where these do not.
  [[nodiscard]] std::optional<CauseSet> as_one(const CauseSet& structural, const std::vector<CauseSet>& found) const {
    const std::size_t most = found.empty() ? SIZE_MAX : found.front().members.size();
    if (most <= structural.members.size()) {
      return std::nullopt;
    }
    for (std::size_t k = 0; k < structural.members.size(); ++k) {
      for (std::size_t c = 0; c < table_.candidates.size(); ++c) {
        const std::vector<std::size_t>& parts = kinds_[table_.candidates[c].effect].stands_for;
        if (std::ranges::find(parts, table_.candidates[structural.members[k]].effect) == parts.end()) {
          continue;
        }
        std::vector<std::size_t> members = structural.members;
        members[k] = c;
        std::sort(members.begin(), members.end());
        CauseSet whole = evaluate(table_, std::move(members), BaseModel::refitted);
        if (excess(whole) > excess(structural) + margin(structural)) {
          continue;
        }
        const std::vector<CauseSet> sets = explain_theta(whole);
        if (!sets.empty() && sets.front().members.size() < most) {
          return whole;
        }
      }
    }
    return std::nullopt;
  }

  // The set without those of its members that explain nothing once the others are there: these reach the floor.
  [[nodiscard]] CauseSet without_idle(CauseSet set) const {
    for (std::size_t k = 0; k < set.members.size() && set.members.size() > 1;) {
      CauseSet without = evaluate_without(table_, set, k, BaseModel::nominal);
      if (excess(without) <= options_.tolerated_floor &&
          without.held_out_error - set.held_out_error < options_.smallest) {
        set = std::move(without);
        k = 0;
      } else {
        ++k;
      }
    }
    return set;
  }

  // Of the structural causes those that are among all.
  void leave_out_idle(Selection& result) const {
    std::vector<std::size_t> members = result.structural.members;
    const auto idle = [&](std::size_t c) {
      return std::ranges::none_of(result.all.members, [&](std::size_t other) {
        return table_.candidates[other].effect == table_.candidates[c].effect;
      });
    };
    if (std::erase_if(members, idle) > 0) {
      result.structural = evaluate(table_, std::move(members), BaseModel::refitted);
    }
  }

  // A set of causes that may be all of what there is.
  struct Rival {
    CauseSet set;
    std::size_t structural = 0;  // of what these grew from
    bool moves_theta = false;    // without saying why
  };

  // Lengths of the robot in the set that nothing but the efforts shows.
  [[nodiscard]] auto unseen_lengths(const CauseSet& set) const {
    return std::ranges::count_if(set.members,
                                 [&](std::size_t c) { return kinds_[table_.candidates[c].effect].unseen_length; });
  }

  // Takes this one of the rivals for what there is.
  void choose(Selection& result, const Rival& rival, const std::vector<CauseSet>& structural,
              bool nominal_trusted) const {
    result.all = rival.set;
    result.structural = structural[rival.structural];
    result.theta_moved = rival.moves_theta;
    if (!result.theta_moved) {
      leave_out_idle(result);
    }
    result.base = sized_with(result.all, nominal_trusted);
  }

  // The treatment of θ that the causes of the set have their sizes from.
  [[nodiscard]] BaseModel sized_with(const CauseSet& set, bool nominal_trusted) const {
    const bool moves_theta = std::ranges::any_of(set.members, [&](std::size_t c) {
      const std::size_t effect = table_.candidates[c].effect;
      // What stands for a cause of θ too has its size from θ held.
      return moves_theta_only_[effect] || (nominal_trusted && !kinds_[effect].stands_for.empty());
    });
    return moves_theta ? BaseModel::nominal : BaseModel::refitted;
  }

  // Whether `whole` is `part` with more to choose and does not do better for it.
  [[nodiscard]] bool needlessly_contains(const CauseSet& whole, const CauseSet& part, double structural,
                                         BaseModel base) const {
    return part.coefficients < whole.coefficients &&
           fit_unexplained_by(table_, part.members, whole.members, base) < options_.contained &&
           !gains(part, whole, structural, base);
  }

  // Leaves out of the credible sets what needlessly contains another one, and what needs two lengths of the robot to be
  // wrong at once on a log that shows no length, where another needs none.
  void leave_out_needless(Selection& result, const std::vector<Rival>& rivals, bool nominal_trusted) const {
    const BaseModel base = nominal_trusted ? BaseModel::nominal : BaseModel::refitted;
    std::vector<CredibleSet>& credible = result.credible;
    const auto moves_theta = [&](const CredibleSet& member) {
      return std::ranges::any_of(
          rivals, [&](const Rival& rival) { return rival.set.members == member.set.members && rival.moves_theta; });
    };
    std::erase_if(credible, [&, all = credible](const CredibleSet& member) {
      return std::ranges::any_of(all, [&](const CredibleSet& other) {
        if (moves_theta(other) || moves_theta(member)) {
          return false;
        }
        return (unseen_lengths(member.set) > 1 && unseen_lengths(other.set) == 0) ||
               needlessly_contains(member.set, other.set, result.refitted_excess, base);
      });
    });
  }

  // Causes of the set whose share of the gap is more than nothing in two decimals.
  [[nodiscard]] std::vector<std::size_t> principal(const CauseSet& set, BaseModel base) const {
    constexpr double kNothing = 0.005;
    std::vector<std::size_t> members;
    const std::vector<double> shares = shapley_shares(table_, set, base, gap_);
    for (std::size_t k = 0; k < set.members.size(); ++k) {
      if (!(shares[k] < kNothing)) {
        members.push_back(set.members[k]);
      }
    }
    return members.empty() ? set.members : members;
  }

  // Names the principal causes of the credible sets. Where these are the same in all and do without what differs, they
  // are all there is: of what is left too little to be told from one another is none.
  void leave_out_trifles(Selection& result, bool nominal_trusted) const {
    const BaseModel base = nominal_trusted ? BaseModel::nominal : BaseModel::refitted;
    for (CredibleSet& member : result.credible) {
      member.principal = member.set.members.size() > 1 ? principal(member.set, base) : member.set.members;
    }
    if (result.credible.size() < 2 || result.theta_moved) {
      return;
    }
    const std::vector<std::size_t>& first = result.credible.front().principal;
    const auto names = [&](const std::vector<std::size_t>& members) { return sorted_names({members, 0.0, {}, 0.0}); };
    const bool same = std::ranges::all_of(
        result.credible, [&](const CredibleSet& member) { return names(member.principal) == names(first); });
    if (!same || first.empty() || first.size() == result.all.members.size()) {
      return;
    }
    Selection without = result;
    without.all = evaluate(table_, first, base);
    leave_out_idle(without);
    without.left = without.structural.held_out_error - floor_;
    if (!tolerable(without)) {
      return;
    }
    without.base = sized_with(without.all, nominal_trusted);
    without.trifles = std::move(result.credible);
    without.credible = {{without.all, 1.0, without.all.members}};
    result = std::move(without);
  }

  // What the causes may leave.
  [[nodiscard]] double tolerable_remainder(const Selection& result) const {
    return std::max({options_.tolerated * result.refitted_excess + inexact(result.structural),
                     std::min(options_.tolerated_nominal * gap_, 4.0 * options_.tolerated_floor),
                     options_.tolerated_floor});
  }

  [[nodiscard]] bool tolerable(const Selection& result) const { return result.left <= tolerable_remainder(result); }

  // Returns false where the causes are a fit and no explanation: by all credible sets, those that are left out of the
  // answer among them.
  bool add_parametric(Selection& result, const std::vector<CauseSet>& structural_rivals, bool nominal_trusted) const {
    std::vector<CauseSet> structural = structural_rivals;
    if (structural.empty()) {
      structural.push_back(result.structural);
    }
    std::vector<Rival> rivals;
    const auto add = [&](const CauseSet& set, std::size_t i) {
      CauseSet needed = without_idle(set);
      if (std::ranges::none_of(rivals, [&](const Rival& r) { return r.set.members == needed.members; })) {
        rivals.push_back({std::move(needed), i});
      }
    };
    for (std::size_t i = 0; i < structural.size(); ++i) {
      if (!nominal_trusted) {
        rivals.push_back({structural[i], i});
        continue;
      }
      std::vector<CauseSet> found = explain_theta(structural[i]);
      if (std::optional<CauseSet> whole = as_one(structural[i], found)) {
        structural[i] = std::move(*whole);
        found = explain_theta(structural[i]);
      }
      if (found.empty()) {
        rivals.push_back({structural[i], i, true});
        continue;
      }
      const CauseSet& first = simplest_of(found);
      add(first, i);
      for (const CauseSet& set : found) {
        const bool close = set.held_out_error <= first.held_out_error + 3.0 * margin(first);
        const bool contains =
            first.coefficients < set.coefficients &&
            unexplained_by(table_, first.members, set.members, BaseModel::nominal) < options_.contained;
        if (set.members != first.members && close && !contains) {
          add(set, i);
        }
      }
    }
    // With θ held, the right one of causes that do as well with θ fitted again is the one that leaves least, with the
    // fewest causes, and of these the fewest lengths that nothing but the efforts shows.
    const auto unlikeliness = [&](const CauseSet& set) { return std::pair(set.members.size(), unseen_lengths(set)); };
    const std::size_t most = rivals.front().moves_theta ? SIZE_MAX : rivals.front().set.members.size();
    const auto comparable = [&](const Rival& rival) { return !rival.moves_theta && rival.set.members.size() <= most; };
    const CauseSet* least = nullptr;
    for (const Rival& rival : rivals) {
      if (nominal_trusted && comparable(rival) &&
          (least == nullptr || rival.set.held_out_error < least->held_out_error)) {
        least = &rival.set;
      }
    }
    if (least != nullptr) {
      const double as_good = excess(*least) + margin(*least);
      auto lead = rivals.end();
      for (auto rival = rivals.begin(); rival != rivals.end(); ++rival) {
        const bool good = comparable(*rival) && excess(rival->set) <= as_good;
        if (good && (lead == rivals.end() || unlikeliness(rival->set) < unlikeliness(lead->set))) {
          lead = rival;
        }
      }
      std::rotate(rivals.begin(), lead, lead + 1);
    }
    choose(result, rivals.front(), structural, nominal_trusted);
    std::vector<CauseSet> fewest;
    for (const Rival& rival : rivals) {
      if (rival.set.members.size() <= result.all.members.size()) {
        fewest.push_back(rival.set);
      }
    }
    confide(result, fewest);
    const bool a_fit = arbitrary(result.credible);
    leave_out_needless(result, rivals, nominal_trusted);
    if (!result.credible.empty() && result.credible.front().set.members != result.all.members) {
      const auto of_first = [&](const Rival& rival) {
        return rival.set.members == result.credible.front().set.members;
      };
      choose(result, *std::ranges::find_if(rivals, of_first), structural, nominal_trusted);
    }
    leave_out_trifles(result, nominal_trusted);
    return !a_fit;
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
    // What is worse by less than a tenth of a cause's least gain is as good; by how much more is for the blocks to say.
    const double as_good = std::max(options_.misfit * excess(rivals.front()), 0.1 * options_.smallest);
    const std::vector<double> p =
        model_confidence_set(losses, {.margin = as_good * table_.gram->rows().mean(), .seed = options_.seed});
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
  double level_ = 0.0;                  // of a test
  bool enough_time_ = true;             // Selection::enough_time
  bool nominal_is_better_ = false;      // without causes, held out
  std::vector<bool> moves_theta_only_;  // by effect: θ fitted again takes all of it
  std::vector<bool> does_nothing_;      // by effect: all of its columns are zeros
  double gap_ = 0.0;
};

}  // namespace

bool saves_more_than_chance(const Eigen::VectorXd& savings, double level, std::uint64_t seed) {
  return signed_rank(savings) > core::normal_upper_quantile(level) || sign_flip_p(savings, seed) < level;
}

Selection select_causes(const CandidateTable& table, const std::vector<EffectKind>& kinds, bool nominal_trusted,
                        double floor_error, const SelectionOptions& options) {
  check::that(table.gram != nullptr, "CandidateTable::gram", "set");
  check::that(kinds.size() == table.names.size(), "kinds", "one for each effect");
  return Selector(table, kinds, floor_error, options).run(nominal_trusted);
}

namespace {

double criterion(const CandidateTable& table, const std::vector<std::size_t>& members) {
  const Subset subset = subset_of(table, members, BaseModel::refitted);
  const double n = table.gram->all_rows();
  double k = static_cast<double>(subset.columns.size());
  for (const std::size_t c : members) {
    k += static_cast<double>(table.candidates[c].shape.size());
  }
  const double square = std::max(table.gram->fit(subset).mean_square, std::numeric_limits<double>::min());
  return n * std::log(square) + k * std::log(n);
}

bool takes_effect(const CandidateTable& table, const std::vector<std::size_t>& members, std::size_t candidate) {
  return std::ranges::any_of(
      members, [&](std::size_t c) { return table.candidates[c].effect == table.candidates[candidate].effect; });
}

}  // namespace

NaiveChoice naive_selection(const CandidateTable& table, std::size_t largest) {
  NaiveChoice choice{{}, criterion(table, {})};
  while (choice.members.size() < largest) {
    std::size_t best = table.candidates.size();
    for (std::size_t c = 0; c < table.candidates.size(); ++c) {
      if (takes_effect(table, choice.members, c)) {
        continue;
      }
      std::vector<std::size_t> members = choice.members;
      members.push_back(c);
      const double value = criterion(table, members);
      if (value < choice.criterion) {
        choice.criterion = value;
        best = c;
      }
    }
    if (best == table.candidates.size()) {
      break;
    }
    choice.members.push_back(best);
  }
  return choice;
}

}  // namespace wheelwright::gap

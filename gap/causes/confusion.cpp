// SPDX-License-Identifier: Apache-2.0
#include "gap/causes/confusion.hpp"

#include <algorithm>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "gap/rows/block_gram.hpp"

namespace wheelwright::gap {
namespace {

// Σ signature² that the columns `on` leave of Σ weight·column.
double left_of(const BlockGram& gram, const std::vector<std::size_t>& columns, const Eigen::VectorXd& weights,
               const std::vector<std::size_t>& on) {
  return std::max(weights.dot(remainder(gram, columns, on) * weights), 0.0);
}

const std::vector<std::size_t>& theta_columns(const CandidateTable& table, BaseModel base) {
  return base == BaseModel::refitted ? table.base : table.unknown;
}

double beside_theta(const CandidateTable& table, const Signature& signature, BaseModel base) {
  return left_of(*table.gram, own_columns(table.candidates[signature.candidate]), signature.weights,
                 theta_columns(table, base));
}

// The candidate of effect `e` whose shape its signature has, if it has any.
std::optional<std::size_t> typical_candidate(const CandidateTable& table, std::size_t e, BaseModel base,
                                             double without) {
  constexpr double kPresent = 0.9;
  std::vector<std::size_t> candidates;
  double least = std::numeric_limits<double>::infinity();
  std::size_t best = 0;
  for (std::size_t c = 0; c < table.candidates.size(); ++c) {
    if (table.candidates[c].effect == e) {
      candidates.push_back(c);
      if (const double error = evaluate(table, {c}, base).held_out_error; error < least) {
        least = error;
        best = c;
      }
    }
  }
  if (candidates.empty()) {
    return std::nullopt;
  }
  return least < kPresent * without ? best : candidates[candidates.size() / 2];
}

}  // namespace

const std::vector<std::size_t>& own_columns(const Candidate& candidate) {
  return candidate.own.empty() ? candidate.columns : candidate.own;
}

std::vector<std::optional<Signature>> signatures(const CandidateTable& table, BaseModel base) {
  const double without = evaluate(table, {}, base).held_out_error;
  std::vector<std::optional<Signature>> of_effect(table.names.size());
  for (std::size_t e = 0; e < of_effect.size(); ++e) {
    const std::optional<std::size_t> c = typical_candidate(table, e, base, without);
    if (!c) {
      continue;
    }
    const Candidate& candidate = table.candidates[*c];
    const std::vector<std::size_t>& own = own_columns(candidate);
    Signature signature{*c, Eigen::VectorXd::Ones(static_cast<Eigen::Index>(own.size()))};
    if (!candidate.unit_coefficient) {
      Subset subset = subset_of(table, {*c}, base);
      subset.sign.clear();
      const Eigen::VectorXd fitted = table.gram->fit(subset).coefficients;
      for (std::size_t k = 0; k < own.size(); ++k) {
        const auto at = std::ranges::find(subset.columns, own[k]) - subset.columns.begin();
        signature.weights[static_cast<Eigen::Index>(k)] = fitted[at];
      }
    }
    if (beside_theta(table, signature, base) > 0.0) {
      of_effect[e] = std::move(signature);
    }
  }
  return of_effect;
}

double made_up(const CandidateTable& table, const Signature& a, const Signature& b, BaseModel base) {
  const double square = beside_theta(table, a, base);
  if (!(square > 0.0)) {
    return 1.0;
  }
  std::vector<std::size_t> on = theta_columns(table, base);
  const std::vector<std::size_t>& columns = own_columns(table.candidates[b.candidate]);
  on.insert(on.end(), columns.begin(), columns.end());
  const double left = left_of(*table.gram, own_columns(table.candidates[a.candidate]), a.weights, on);
  return std::clamp(1.0 - left / square, 0.0, 1.0);
}

std::size_t first_of_name(const CandidateTable& table, const std::vector<std::optional<Signature>>& of_effect,
                          const std::string& name) {
  std::size_t e = 0;
  while (e < of_effect.size() && !(of_effect[e] && table.names[e] == name)) {
    ++e;
  }
  return e;
}

std::vector<ConfusablePair> confusable_pairs(const CandidateTable& table,
                                             const std::vector<std::optional<Signature>>& of_effect, BaseModel base,
                                             double least) {
  const auto stands = [&](std::size_t e) { return first_of_name(table, of_effect, table.names[e]) == e; };
  std::vector<ConfusablePair> pairs;
  for (std::size_t a = 0; a < of_effect.size(); ++a) {
    for (std::size_t b = a + 1; b < of_effect.size(); ++b) {
      if (!stands(a) || !stands(b)) {
        continue;
      }
      const double similarity = std::max(made_up(table, *of_effect[a], *of_effect[b], base),
                                         made_up(table, *of_effect[b], *of_effect[a], base));
      if (similarity >= least) {
        pairs.push_back({table.names[a], table.names[b], similarity, false, {}});
      }
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const ConfusablePair& a, const ConfusablePair& b) { return a.similarity > b.similarity; });
  return pairs;
}

std::vector<std::string> not_excited(const CandidateTable& table, const std::vector<Effect>& catalogue,
                                     const Drive& drive, double least) {
  const BlockGram& gram = *table.gram;
  std::vector<double> beyond(catalogue.size(), 0.0);
  for (const Candidate& candidate : table.candidates) {
    for (std::size_t k = 0; k < candidate.columns.size(); ++k) {
      const double square = gram.square(candidate.columns[k]);
      if (square > 0.0) {
        const double left = left_of(gram, {candidate.columns[k]}, Eigen::VectorXd::Ones(1), table.base);
        beyond[candidate.effect] = std::max(beyond[candidate.effect], left / square);
      }
    }
  }
  std::vector<std::string> sentences;
  const auto say = [&sentences](std::string sentence) {
    if (std::ranges::find(sentences, sentence) == sentences.end()) {
      sentences.push_back(std::move(sentence));
    }
  };
  for (std::size_t e = 0; e < catalogue.size(); ++e) {
    const Applicability applies = applicability(catalogue[e], drive);
    if (!applies.applies) {
      say(catalogue[e].name + ": " + applies.reason);
    } else if (beyond[e] < least && !catalogue[e].parametric) {
      say(catalogue[e].name + ": this log does not show it; " + catalogue[e].excite);
    }
  }
  return sentences;
}

}  // namespace wheelwright::gap

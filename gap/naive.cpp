// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/gap/naive.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace wheelwright::gap {
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

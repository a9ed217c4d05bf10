// SPDX-License-Identifier: Apache-2.0
#include <wheelwright/logs/csv_streams.hpp>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include <wheelwright/logs/log_columns.hpp>
#include <wheelwright/logs/row_log.hpp>

namespace wheelwright {
namespace {

constexpr double rarely_missing = 0.2;

}  // namespace

CsvStreamFinder::CsvStreamFinder(std::vector<std::string> names) : names_(std::move(names)), filled_(names_.size()) {}

void CsvStreamFinder::add(double t, const double* values) {
  t_.push_back(t);
  for (std::size_t c = 0; c < filled_.size(); ++c) {
    filled_[c].push_back(!std::isnan(values[c]));
  }
}

std::vector<CsvStream> CsvStreamFinder::streams() const {
  std::vector<CsvStream> found;
  std::vector<std::vector<bool>> rows;  // of each stream
  std::optional<std::size_t> dense;
  for (std::size_t c = 0; c < filled_.size(); ++c) {
    const auto count = static_cast<double>(std::ranges::count(filled_[c], true));
    const double share = t_.empty() ? 1.0 : count / static_cast<double>(t_.size());
    if (share == 0.0) {
      continue;
    }
    const bool is_dense = share >= 1.0 - rarely_missing;
    auto stream = is_dense ? dense : std::nullopt;
    for (std::size_t s = 0; !is_dense && s < rows.size(); ++s) {
      stream = rows[s] == filled_[c] ? std::optional(s) : stream;
    }
    if (!stream) {
      stream = found.size();
      found.emplace_back();
      found.back().filled = share;
      rows.push_back(filled_[c]);
      dense = is_dense ? stream : dense;
    }
    found[*stream].columns.push_back(c);
  }
  for (std::size_t s = 0; s < found.size(); ++s) {
    std::vector<double> steps;
    std::optional<double> before;
    for (std::size_t k = 0; k < t_.size(); ++k) {
      if (rows[s][k]) {
        if (before && t_[k] > *before) {
          steps.push_back(t_[k] - *before);
        }
        before = t_[k];
      }
    }
    found[s].median_step = std::llround(middle_of(steps) * 1e9);
  }
  const auto weight = [&](const CsvStream& stream) {
    int sum = 0;
    for (const std::size_t c : stream.columns) {
      sum += row_weight(names_[c]);
    }
    return sum;
  };
  std::ranges::stable_sort(found, [&](const CsvStream& a, const CsvStream& b) { return weight(a) > weight(b); });
  return found;
}

}  // namespace wheelwright

// SPDX-License-Identifier: Apache-2.0
#include "core/interleaved.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>

#include "core/statistics.hpp"

namespace wheelwright::core {
namespace {

constexpr double kApart = 5.0;          // distances of the neighbours
constexpr double kOfRange = 0.02;       // of a column's range
constexpr std::size_t kFine = 50;       // values of a column that is finely resolved
constexpr double kSameValue = 2e-3;     // of a column's range: counts over a measured step scatter by less
constexpr std::size_t kFewestRows = 5;  // of a second source
constexpr double kLeastShare = 0.002;   // likewise
constexpr double kAlternates = 0.3;     // steps over two rows against those over one
constexpr double kTracksApart = 0.1;    // of a column's range, in the middle
constexpr double kAboveNoise = 10.0;    // of the other rows' bends
constexpr double kFollows = 0.3;        // steps inside the second source against those out of it
constexpr double kSameContent = 0.35;   // of the rows that stand apart: of a constant source half, where it alternates
constexpr double kSeldom = 0.02;        // of the rows: a number that the first source hardly takes

using Column = std::vector<double>;

struct Telling {
  const Column* values = nullptr;
  std::size_t index = 0;
  double range = 0.0;
  bool fine = false;
};

double range_of(const Column& values) {
  Column known;
  std::ranges::copy_if(values, std::back_inserter(known), [](double v) { return std::isfinite(v); });
  if (known.size() < 2) {
    return 0.0;
  }
  const std::size_t last = known.size() - 1;
  return order_statistic(known, last - last / 100) - order_statistic(known, last / 100);
}

bool is_fine(const Column& values, double range) {
  std::set<double> seen;
  for (const double v : values) {
    if (std::isfinite(v) && seen.insert(std::round(v / (kSameValue * range))).second && seen.size() > kFine) {
      return true;
    }
  }
  return false;
}

std::vector<double> content_of(const std::vector<Telling>& columns, std::size_t row) {
  std::vector<double> out;
  for (const Telling& c : columns) {
    out.push_back(std::isnan((*c.values)[row]) ? 0.0 : (*c.values)[row]);
  }
  return out;
}

// First rows of runs of equal content.
std::vector<std::size_t> runs_of(const std::vector<Telling>& columns, std::size_t rows) {
  std::vector<std::size_t> runs;
  for (std::size_t k = 0; k < rows; ++k) {
    const bool repeats = k > 0 && std::ranges::all_of(columns, [&](const Telling& c) {
                           const double now = (*c.values)[k], before = (*c.values)[k - 1];
                           return now == before || (std::isnan(now) && std::isnan(before));
                         });
    if (!repeats) {
      runs.push_back(k);
    }
  }
  return runs;
}

bool tells(const Telling& c, std::size_t before, std::size_t row, std::size_t after) {
  const double a = (*c.values)[before], x = (*c.values)[row], b = (*c.values)[after];
  const double off = std::max({std::min(a, b) - x, x - std::max(a, b), 0.0});
  return off > kApart * std::abs(b - a) && off > kOfRange * c.range;
}

// Runs (places in `runs`) that stand apart from both neighbours.
std::vector<std::size_t> apart(const std::vector<Telling>& columns, const std::vector<std::size_t>& runs,
                               std::size_t& example) {
  std::vector<std::size_t> out;
  for (std::size_t j = 1; j + 1 < runs.size(); ++j) {
    std::size_t votes = 0;
    bool fine = false;
    for (const Telling& c : columns) {
      if (tells(c, runs[j - 1], runs[j], runs[j + 1])) {
        ++votes;
        if (c.fine && !fine) {
          example = c.index;
        }
        fine = fine || c.fine;
      }
    }
    if (fine && 2 * votes >= columns.size()) {
      out.push_back(j);
    }
  }
  return out;
}

// Whether the columns go back and forth row by row between two tracks.
bool alternates(const std::vector<Telling>& columns, const std::vector<std::size_t>& runs) {
  std::size_t votes = 0, fine = 0;
  for (const Telling& c : columns) {
    std::vector<double> one, two;
    for (std::size_t j = 2; j < runs.size(); ++j) {
      const double now = (*c.values)[runs[j]];
      one.push_back(std::abs(now - (*c.values)[runs[j - 1]]));
      two.push_back(std::abs(now - (*c.values)[runs[j - 2]]));
    }
    const double step = median(std::move(one));
    fine += c.fine ? 1U : 0U;
    votes += c.fine && step > kTracksApart * c.range && median(std::move(two)) < kAlternates * step ? 1U : 0U;
  }
  return fine > 0 && 2 * votes >= fine && votes > 0;
}

// Whether the rows that stand apart make a track of their own, and not merely more of the noise of the others.
bool follow_each_other(const std::vector<Telling>& columns, const std::vector<std::size_t>& runs,
                       const std::vector<std::size_t>& found) {
  std::vector<bool> near(runs.size(), false);
  for (const std::size_t j : found) {
    near[j - 1] = near[j] = near[j + 1] = true;
  }
  std::size_t votes = 0, fine = 0;
  for (const Telling& c : columns) {
    if (!c.fine) {
      continue;
    }
    ++fine;
    const auto at = [&](std::size_t j) { return (*c.values)[runs[j]]; };
    std::vector<double> inside, outside;
    for (std::size_t i = 1; i < found.size(); ++i) {
      inside.push_back(std::abs(at(found[i]) - at(found[i - 1])));
      outside.push_back(std::abs(at(found[i]) - at(found[i] - 1)));
    }
    double bends = 0.0, rows = 0.0;
    for (std::size_t j = 1; j + 1 < runs.size(); ++j) {
      if (!near[j]) {
        bends += std::pow(at(j) - 0.5 * (at(j - 1) + at(j + 1)), 2);
        rows += 1.0;
      }
    }
    const double off = median(std::move(outside));
    votes += median(std::move(inside)) < kFollows * off && rows > 0.0 && off > kAboveNoise * std::sqrt(bends / rows)
                 ? 1U
                 : 0U;
  }
  return votes > 0 && 2 * votes >= fine;
}

}  // namespace

InterleavedRows interleaved_rows(const std::vector<const std::vector<double>*>& columns) {
  std::vector<Telling> telling;
  std::size_t rows = 0;
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (columns[k] == nullptr) {
      continue;
    }
    rows = columns[k]->size();
    if (const double range = range_of(*columns[k]); range > 0.0) {
      telling.push_back({columns[k], k, range, is_fine(*columns[k], range)});
    }
  }
  InterleavedRows out;
  if (telling.empty() || std::ranges::none_of(telling, &Telling::fine)) {
    return out;
  }
  const std::vector<std::size_t> runs = runs_of(telling, rows);
  const std::vector<std::size_t> found = apart(telling, runs, out.column);
  if (found.size() < kFewestRows || static_cast<double>(found.size()) < kLeastShare * static_cast<double>(rows)) {
    return out;
  }
  std::map<std::vector<double>, std::size_t> contents;
  for (const std::size_t j : found) {
    ++contents[content_of(telling, runs[j])];
  }
  const auto most = std::ranges::max_element(contents, {}, [](const auto& of) { return of.second; });
  if (most->second >= kFewestRows &&
      static_cast<double>(most->second) > kSameContent * static_cast<double>(found.size())) {
    // Its number in a fine column is not one that other rows take often.
    std::size_t same = 0, others = 0;
    for (std::size_t i = 0; i < telling.size(); ++i) {
      if (!telling[i].fine) {
        continue;
      }
      std::size_t taken = 0;
      for (const std::size_t j : runs) {
        taken += (*telling[i].values)[j] == most->first[i] && content_of(telling, j) != most->first ? 1U : 0U;
      }
      ++same;
      others += static_cast<double>(taken) < kSeldom * static_cast<double>(runs.size()) ? 1U : 0U;
    }
    if (same > 0 && others > 0) {
      out.constant = true;
      for (std::size_t j = 0; j < runs.size(); ++j) {
        if (content_of(telling, runs[j]) != most->first) {
          continue;
        }
        const std::size_t end = j + 1 < runs.size() ? runs[j + 1] : rows;
        for (std::size_t k = runs[j]; k < end; ++k) {
          out.rows.push_back(k);
        }
      }
      return out;
    }
  }
  if (alternates(telling, runs) || follow_each_other(telling, runs, found)) {
    for (const std::size_t j : found) {
      out.rows.push_back(runs[j]);
    }
  }
  return out;
}

}  // namespace wheelwright::core

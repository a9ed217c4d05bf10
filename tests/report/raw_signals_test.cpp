// SPDX-License-Identifier: Apache-2.0
/// \file
/// What is kept of a log that is longer than a page can draw.
#include <algorithm>
#include <functional>
#include <random>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "results/report/signals.hpp"

namespace wheelwright::report::raw_signals_test {
namespace {

// Two columns of noise in segments of uneven lengths.
LogTable noisy(std::size_t rows) {
  std::mt19937 generator(3);
  std::normal_distribution<double> normal;
  LogTable table;
  table.names = {"omega_r", "tau_r"};
  table.columns.resize(2);
  for (std::size_t k = 0, next = 0; k < rows; ++k) {
    if (k == next) {
      table.segment_starts.push_back(k);
      next += 300 + generator() % 900;
    }
    table.t.push_back(0.01 * static_cast<double>(k) + static_cast<double>(table.segment_starts.size()));
    table.columns[0].push_back(normal(generator));
    table.columns[1].push_back(normal(generator));
  }
  return table;
}

TEST(RawSignals, OfAShortLogAreItsRows) {
  const LogTable table = noisy(1000);
  TableSource log(table, 37);
  const LogTable kept = report::raw_signals(log, 1000);
  EXPECT_EQ(kept.t, table.t);
  EXPECT_EQ(kept.columns, table.columns);
  EXPECT_EQ(kept.segment_starts, table.segment_starts);
}

TEST(RawSignals, OfALongLogKeepThePeaksOfEverySegment) {
  const LogTable table = noisy(50'000);
  TableSource log(table, 997);
  for (const std::size_t most : {1000U, 6000U, 40'000U}) {
    const LogTable kept = report::raw_signals(log, most);
    EXPECT_LE(kept.rows(), most);
    EXPECT_GE(kept.rows(), most / 4);
    ASSERT_EQ(kept.segment_starts.size(), table.segment_starts.size());
    for (std::size_t s = 0; s < kept.segment_starts.size(); ++s) {
      const bool last = s + 1 == kept.segment_starts.size();
      const std::size_t a = kept.segment_starts[s], b = last ? kept.rows() : kept.segment_starts[s + 1];
      const std::size_t from = table.segment_starts[s], to = last ? table.rows() : table.segment_starts[s + 1];
      EXPECT_EQ(kept.t[a], table.t[from]);
      EXPECT_TRUE(std::is_sorted(kept.t.begin() + static_cast<std::ptrdiff_t>(a),
                                 kept.t.begin() + static_cast<std::ptrdiff_t>(b), std::less_equal<>()));
      for (std::size_t c = 0; c < 2; ++c) {
        const auto extremes = [](const std::vector<double>& column, std::size_t first, std::size_t end) {
          const auto [low, high] = std::minmax_element(column.begin() + static_cast<std::ptrdiff_t>(first),
                                                       column.begin() + static_cast<std::ptrdiff_t>(end));
          return std::pair(*low, *high);
        };
        EXPECT_EQ(extremes(kept.columns[c], a, b), extremes(table.columns[c], from, to));
      }
    }
  }
}

}  // namespace
}  // namespace wheelwright::report::raw_signals_test
